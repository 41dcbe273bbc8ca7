"""Makes the picture of the live page in README: `python docs/live_page.py`, with Chromium and its driver."""

import json
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory

from selenium.webdriver import Chrome, ChromeOptions

MISSION = {"scenario": "office", "carriers": 2, "rovers": 2, "strategy": "temporal", "planner": "anytime", "seed": 1}
AT_MS, SPEED = 86_000, 10  # when the picture is taken, in the mission; seconds of the mission per second
SIZE = (1440, 900)


def make(picture: Path, port: int = 8137) -> None:
    """Write the picture: a service of its own runs a mission, and a browser shows it."""
    url = f"http://127.0.0.1:{port}"
    data = TemporaryDirectory()
    service = subprocess.Popen([sys.executable, "-m", "marsupial", "serve", "--port", str(port)], cwd=data.name)
    options = ChromeOptions()
    for option in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(option)
    browser = Chrome(options)
    try:
        while _status(f"{url}/readyz") != 200:
            time.sleep(0.5)
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False},
        )
        body = json.dumps(MISSION | {"budget": {"steps": 20}, "speed": SPEED}).encode()
        request = urllib.request.Request(f"{url}/v1/simulations", body, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request) as answer:
            mission = json.load(answer)
        browser.get(f"{url}/#/missions/{mission['id']}")
        shown = "return Number(document.querySelector('.transport input[type=range]')?.value ?? 0)"
        while browser.execute_script(shown) < AT_MS:
            time.sleep(0.1)
        browser.save_screenshot(str(picture))
    finally:
        browser.quit()
        service.terminate()
        service.wait()
        data.cleanup()


def _status(url: str) -> int:
    try:
        with urllib.request.urlopen(url) as answer:
            return int(answer.status)
    except OSError:
        return 0


if __name__ == "__main__":
    make(Path(__file__).with_name("pictures") / "live.png")
