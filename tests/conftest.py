"""Fixtures that many tests share."""

from __future__ import annotations

import asyncio
import inspect
import os
import sys
from collections.abc import Generator, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import pytest
import typer
from hypothesis import HealthCheck, settings
from support.pictures.browser import Browser, chromium, missing, tab
from support.processes.process_tree import no_job_runs
from support.waiting import HANG_S

if TYPE_CHECKING:
    from selenium.webdriver.chrome.webdriver import WebDriver
    from xdist.remote import Producer
    from xdist.scheduler import Scheduling

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)
TESTS = Path(__file__).resolve().parent
SHARED_MAPS = TESTS.parents[1] / "shared" / "maps"

TOGETHER = {
    "tests/replay/test_page_in_browser.py": "browser",
    "tests/replay/test_compared_pages.py": "browser",
    "tests/services/test_live_page.py": "browser",
    "tests/services/test_start_page.py": "browser",
}
"""Files that share a fixture that starts slowly, and the fixture."""

LONG = (
    *TOGETHER,
    "tests/bench/test_compare_ray.py",
    "tests/library/test_missions.py",
    "tests/services/test_readiness.py",
    "tests/services/test_service_connections.py",
    "tests/test_conformance_missions.py",
    "tests/test_docs.py",
    "tests/test_codecache.py",
    "tests/test_library_docs.py",
    "tests/test_tutorial.py",
    "tests/test_wheel.py",
)
"""Files that take long or would otherwise run last."""


settings.register_profile(
    "patient", deadline=None, derandomize=True, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("drawn", settings.get_profile("patient"), derandomize=False, max_examples=1000)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--no-skips", action="store_true", help="let tests fail that would be skipped")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    return _judged((yield), item.config)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    return _judged((yield), collector.config)


def _judged(report: Report, config: pytest.Config) -> Report:
    """Count a skipped test or file as failed where everything that tests need is to be installed."""
    if report.skipped and config.getoption("--no-skips") and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"skipped although --no-skips is given: {report.longreprtext}"
    return report


def pytest_configure(config: pytest.Config) -> None:
    """Set no deadline for examples; parse the commands' options once instead of at each call (40 ms).

    Examples are the same in every run, so that only changes cause failures. `--hypothesis-profile drawn` draws
    new ones, a thousand for each test. Proxies of the environment are for other machines only. Bytecode is kept, as
    otherwise hundreds of processes would each compile all modules (0.4 s), and each worker all tests (25 s).
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    for name in ("no_proxy", "NO_PROXY"):
        os.environ[name] = ",".join(filter(None, ("localhost,127.0.0.1,::1", os.environ.get(name))))
    settings.load_profile(config.getoption("--hypothesis-profile") or "patient")
    typer.main.get_command = cache(typer.main.get_command)


@pytest.fixture
def nothing_left() -> Iterator[None]:
    """Check after a test that no process of a job still runs."""
    yield
    assert no_job_runs()


def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a coroutine test in its own event loop, with a timeout."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    given = {name: pyfuncitem.funcargs[name] for name in inspect.signature(pyfuncitem.obj).parameters}

    async def limited() -> None:
        async with asyncio.timeout(HANG_S):
            await pyfuncitem.obj(**given)

    asyncio.run(limited())
    return True


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> Scheduling:
    """Assign whole files to workers (`pytest -n 3`), and files with a shared fixture to the same worker."""
    from xdist.scheduler import LoadFileScheduling

    class FilesTogether(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return TOGETHER.get(file, file)

    config.option.loadscopereorder = False
    return FilesTogether(config, log)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Run long files first."""
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: not item.nodeid.startswith(LONG))


@pytest.fixture(scope="session")
def shared_maps() -> Path:
    """The folder of real maps beside the checkout; tests that need it are skipped without it."""
    if not SHARED_MAPS.is_dir():
        pytest.skip("the folder of real maps (../shared/maps) is not beside this checkout")
    return SHARED_MAPS


@pytest.fixture(scope="session")
def running_browser() -> Iterator[WebDriver]:
    """Run one browser for all tests of a process; they are skipped without a browser."""
    reason = missing()
    if reason is not None:
        pytest.skip(reason)
    with chromium() as driver:
        yield driver


@pytest.fixture
def browser(running_browser: WebDriver) -> Iterator[Browser]:
    """Open a tab for a test."""
    with tab(running_browser) as found:
        yield found
