"""Makes the pictures of the live page, in README and `first-robot.md`: `python docs/live_page.py`.

Needs Chromium and its driver.
"""

import json
import re
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from selenium.webdriver import Chrome, ChromeOptions

MISSION = {"scenario": "office", "carriers": 2, "rovers": 2, "strategy": "temporal", "planner": "anytime", "seed": 1}
AT_MS, SPEED = 86_000, 10  # when the picture is taken, in the mission; seconds of the mission per second
SIZE, SMALL = (1440, 900), (1200, 720)
DOCS = Path(__file__).parent
URL = "http://127.0.0.1:8137"


def live(picture: Path) -> None:
    """Write the picture of a simulated mission that runs."""
    body = json.dumps(MISSION | {"budget": {"steps": 20}, "speed": SPEED}).encode()
    with _page(SIZE) as browser:
        request = urllib.request.Request(f"{URL}/v1/simulations", body, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request) as answer:
            mission = json.load(answer)
        browser.get(f"{URL}/#/missions/{mission['id']}")
        shown = "return Number(document.querySelector('.transport input[type=range]')?.value ?? 0)"
        while browser.execute_script(shown) < AT_MS:
            time.sleep(0.1)
        browser.save_screenshot(str(picture))


def first_robot(picture: Path) -> None:
    """Write the picture of the mission of `first-robot.md` at its end, led by the program of that page."""
    page = (DOCS / "first-robot.md").read_text(encoding="utf-8")
    (program,) = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    with _page(SMALL) as browser:
        subprocess.run([sys.executable, "-c", program.replace("http://127.0.0.1:8080", URL)], check=True)
        with urllib.request.urlopen(f"{URL}/v1/missions") as answer:
            (mission,) = json.load(answer)["missions"]
        browser.get(f"{URL}/#/missions/{mission['id']}")
        time.sleep(5)
        browser.save_screenshot(str(picture))


@contextmanager
def _page(size: tuple[int, int]) -> Iterator[Chrome]:
    """Yield a browser with a window of a size, beside a service of its own that can plan."""
    options = ChromeOptions()
    for option in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(option)
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "marsupial", "serve", "--port", URL.rpartition(":")[2]]
        service, browser = subprocess.Popen(command, cwd=folder), Chrome(options)
        try:
            while not _is_ready():
                time.sleep(0.5)
            shape = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", shape)
            yield browser
        finally:
            browser.quit()
            service.terminate()
            service.wait()


def _is_ready() -> bool:
    try:
        with urllib.request.urlopen(f"{URL}/readyz") as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


if __name__ == "__main__":
    first_robot(DOCS / "pictures" / "first-robot.png")
    live(DOCS / "pictures" / "live.png")
