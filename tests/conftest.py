"""Fixtures that many tests share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from browser import Browser, chromium, missing, tab

if TYPE_CHECKING:
    from selenium.webdriver.chrome.webdriver import WebDriver

SHARED_MAPS = Path(__file__).resolve().parents[2] / "shared" / "maps"


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
