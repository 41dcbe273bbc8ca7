"""Pages in a real browser: the distribution's headless Chromium, controlled by its WebDriver."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from support.waiting import HANG_S, WaitTimeout, wait_until

if TYPE_CHECKING:
    from selenium.webdriver.chrome.webdriver import WebDriver
    from selenium.webdriver.remote.webelement import WebElement

CHROMIUM, DRIVER = "chromium", "chromedriver"
OPTIONS = (
    "--headless=new",
    "--no-sandbox",  # root, as whom CI runs, can't have one
    "--disable-dev-shm-usage",  # containers have little of it
    "--disable-background-networking",
    "--hide-scrollbars",
)


class View(NamedTuple):
    """Width and height of the viewport in CSS pixels, and the device pixel ratio."""

    width: int
    height: int
    scale: float = 1.0


DESK, PHONE = View(1280, 800), View(390, 844, 2.0)


def missing() -> str | None:
    """Return what is missing for a browser, or None."""
    for program in (CHROMIUM, DRIVER):
        if shutil.which(program) is None:
            return f"{program} is not installed (Debian: chromium, chromium-driver)"
    return None if find_spec("selenium") else "selenium is not installed (pip install 'marsupial[browser]')"


class Browser:
    """One tab of the browser."""

    def __init__(self, driver: WebDriver) -> None:
        self.driver = driver

    def open(self, url: str, view: View = DESK, *, dark: bool = False) -> None:
        """Open a page; earlier console messages are dropped."""
        self.look(view, dark=dark)
        self.driver.get("about:blank")  # else another #fragment would not load the page again
        self.errors()
        self.driver.get(url)

    def look(self, view: View, *, dark: bool = False) -> None:
        """Set the viewport and the colour scheme."""
        size = {"width": view.width, "height": view.height, "deviceScaleFactor": view.scale}
        self._ask("Emulation.setDeviceMetricsOverride", **size, mobile=view == PHONE)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", features=[scheme])

    def run(self, script: str, *values: object) -> Any:
        """Run the body of a function in the page and return its result; `values` are its `arguments`."""
        return self.driver.execute_script(script, *values)

    def value(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        return self.run(f"return ({expression})")

    def wait(self, expression: str) -> Any:
        """Wait until an expression is true in the page, and return its value. Raises WaitTimeout."""
        try:
            return wait_until(lambda: self.value(expression), expression)
        except WaitTimeout as error:
            error.add_note("\n".join(["on the console:", *self.errors()]))
            raise

    def find(self, selector: str) -> WebElement:
        """Wait for a visible element of a selector and return it. Raises WaitTimeout."""
        self.wait(f"document.querySelector({selector!r})?.checkVisibility()")
        return self.driver.find_element("css selector", selector)

    def text(self, selector: str) -> str:
        """Return the visible text of an element."""
        return str(self.find(selector).text)

    def click(self, selector: str) -> None:
        self.find(selector).click()

    def errors(self, *, network: bool = True) -> list[str]:
        """Return the console errors since the last call; `network`: failed requests too."""
        found = [one for one in self.driver.get_log("browser") if one["level"] == "SEVERE"]
        found = [one for one in found if "/readyz" not in one["message"]]  # a busy service may be late for a while
        return [one["message"] for one in found if network or one["source"] != "network"]

    def shot(self, path: Path) -> Path:
        self.driver.save_screenshot(str(path))
        return path

    def colours(self, selector: str) -> dict[str, int]:
        """Return the number of pixels of each colour of a canvas, as `#rrggbbaa`."""
        counted: dict[str, int] = self.run(_COUNT, selector)
        return counted

    def _ask(self, command: str, **parameters: object) -> None:
        self.driver.execute_cdp_cmd(command, parameters)


_COUNT = """
const canvas = document.querySelector(arguments[0]), counts = {};
const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
for (const pixel of new Uint32Array(pixels.buffer)) counts[pixel] = (counts[pixel] || 0) + 1;
const byte = (pixel, bits) => ((pixel >>> bits) & 255).toString(16).padStart(2, "0");
const hex = (pixel) => "#" + [0, 8, 16, 24].map((bits) => byte(pixel, bits)).join("");
return Object.fromEntries(Object.entries(counts).map(([pixel, count]) => [hex(Number(pixel)), count]));
"""


@contextmanager
def chromium(*more: str) -> Iterator[WebDriver]:
    """Run a browser, with `more` options."""
    from selenium.webdriver import Chrome, ChromeOptions
    from selenium.webdriver.chrome.service import Service

    options = ChromeOptions()
    options.binary_location = shutil.which(CHROMIUM) or CHROMIUM
    for option in (*OPTIONS, *more):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = Chrome(options, Service(shutil.which(DRIVER)))
    try:
        driver.set_script_timeout(HANG_S)
        yield driver
    finally:
        driver.quit()


@contextmanager
def tab(driver: WebDriver) -> Iterator[Browser]:
    """Open a tab without the state of earlier ones."""
    from selenium.common.exceptions import TimeoutException

    first = driver.current_window_handle
    driver.switch_to.new_window("tab")
    try:
        yield Browser(driver)
    finally:
        with suppress(TimeoutException):  # of a busy machine: the tab closes later
            driver.close()
        driver.switch_to.window(first)
