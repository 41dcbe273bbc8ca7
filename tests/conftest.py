"""Fixtures that many tests share."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import typer
from browser import Browser, chromium, missing, tab

if TYPE_CHECKING:
    from selenium.webdriver.chrome.webdriver import WebDriver

TESTS = Path(__file__).resolve().parent
SHARED_MAPS = TESTS.parents[1] / "shared" / "maps"

RAY = {"nodes", "cluster"}
LONG = {"ray", "test_tutorial.py", "test_docs.py"}


def pytest_configure() -> None:
    """Have the commands' options read once, not whenever a test calls `main`: that takes 40 ms."""
    typer.main.get_command = cache(typer.main.get_command)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Give all tests on a Ray cluster to one worker, and begin with the groups that take long."""
    if not getattr(config.option, "loadgroup", False):
        return
    groups = {item: "ray" if RAY & set(item.fixturenames) else str(item.path.relative_to(TESTS)) for item in items}
    for item, group in groups.items():
        item.add_marker(pytest.mark.xdist_group(group))
    items.sort(key=lambda item: groups[item] not in LONG)


@pytest.fixture(scope="session")
def shared_maps() -> Path:
    """Folder of real maps that stands beside the checkout; tests that need it are skipped where it is absent."""
    if not SHARED_MAPS.is_dir():
        pytest.skip("the folder of real maps (../shared/maps) is not beside this checkout")
    return SHARED_MAPS


@pytest.fixture(scope="session")
def running_browser() -> Iterator[WebDriver]:
    """Run one browser for all tests of a process; where there is none they are skipped."""
    reason = missing()
    if reason is not None:
        pytest.skip(reason)
    with chromium() as driver:
        yield driver


@pytest.fixture
def browser(running_browser: WebDriver) -> Iterator[Browser]:
    """Open a tab of its own for a test."""
    with tab(running_browser) as found:
        yield found
