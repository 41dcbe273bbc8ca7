"""The page on which missions are started, in a browser: its form, maps, limits and keys."""

import base64
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from live_pages import PRESS, choose
from PIL import Image
from support.pictures.browser import DESK, PHONE, Browser
from support.services.servers import Server
from uploaded_maps import YAML, room

from marsupial_service.keys import KeyFile

DROP = """
const files = arguments[0].map(([name, text]) => new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
const dataTransfer = new DataTransfer();
for (const file of files) dataTransfer.items.add(file);
window.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
"""
"""Drop files, given as names and base64, on the page."""


@pytest.fixture(scope="module")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server for few missions, on maps that are hardly larger than `lobby`."""
    with Server(tmp_path_factory.mktemp("narrow"), "--limit", "simulations=2", "--limit", "cells=2500") as server:
        yield server


STARTING = """
const real = window.fetch, told = { detail: "starting: compiling, 15 of 41 functions" };
window.starts = true;
window.fetch = (path, ...more) => path === "readyz" && window.starts
  ? Promise.resolve(new Response(JSON.stringify(told), { status: 503 })) : real(path, ...more);
"""
"""Have the page be answered as by a service that starts, as long as `starts` is true."""


HELD = """
const real = window.fetch;
window.fetch = async (path, ...more) => {
  if (String(path).includes("preview")) await new Promise((resolve) => { window.answer = resolve; });
  return real(path, ...more);
};
"""
"""Hold back requests for a preview until `answer` is called."""


def upload(browser: Browser, server: Server, *files: Path) -> None:
    """Fill in yaml and image of a map, and request a mission."""
    browser.open(f"{server.url}/")
    choose(browser, scenario="")
    for name, file in zip(("yaml", "image"), files, strict=True):
        browser.find(f"#start-{name}").send_keys(str(file))
    browser.click("form.start button.first")


def open_missions(server: Server) -> list[Any]:
    missions = server.ask("GET", "/v1/missions").document["missions"]
    return [one["id"] for one in missions if one["state"] not in ("cancelling", "ended")]


def start_three(browser: Browser, server: Server, before: str = "") -> str:
    """Ask for three missions, of which one can't be created, and return what the form says."""
    browser.open(f"{server.url}/")
    choose(browser, scenario="lobby", planner="greedy")
    browser.run("document.querySelector('details.others').open = true;" + before)
    for name in ("heuristic", "assignment"):
        browser.run("document.querySelector(arguments[0]).click()", f"#start-beside-{name}")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('form.start > .problem').textContent")
    return str(browser.value("document.querySelector('form.start > .problem').textContent"))


def test_of_missions_side_by_side_all_start_or_none_and_their_limit_is_shown_before(
    browser: Browser, narrow: Server
) -> None:
    problem = start_three(browser, narrow)
    room = "At most 2 simulated missions run here at a time; 2 more may start now."
    assert problem == f"3 missions can't start now. {room}"
    assert browser.value("document.querySelector('.others .note').textContent") == room
    assert narrow.ask("GET", "/v1/missions").document["missions"] == []


def test_missions_side_by_side_are_cancelled_if_one_of_them_is_refused(browser: Browser, pages: Server) -> None:
    before = set(open_missions(pages))
    lost = "let posts = 0; const real = window.fetch; window.fetch = (path, options) =>"
    lost += (
        " path === '/v1/simulations' && ++posts === 3 ? Promise.reject(new TypeError('lost')) : real(path, options);"
    )
    assert "can't be reached" in start_three(browser, pages, lost)
    assert set(open_missions(pages)) <= before


def test_rivals_are_those_that_suit_the_team(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/")
    choose(browser, scenario="lobby")
    offered = "document.querySelector('#start-beside-segmentation').parentElement.checkVisibility()"
    browser.run("document.querySelector('details.others').open = true")
    assert not browser.value(offered)
    choose(browser, rovers=0)
    assert browser.value(offered)
    browser.run("document.querySelector('#start-beside-segmentation').click()")
    choose(browser, rovers=1)
    assert browser.value("document.querySelector('form.start button.first').textContent") == "Start"


def test_errors_in_a_map_are_shown_beside_their_field(browser: Browser, pages: Server, tmp_path: Path) -> None:
    yaml, image = tmp_path / "room.yaml", tmp_path / "room.png"
    yaml.write_text(YAML.replace("resolution", "resolutoin"))
    image.write_bytes(b"no image")
    browser.open(f"{pages.url}/")
    choose(browser, scenario="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('#start-yaml-problem').textContent.includes('choose')")
    browser.find("#start-yaml").send_keys(str(yaml))
    browser.find("#start-image").send_keys(str(image))
    browser.click("form.start button.first")
    browser.wait("document.querySelector('#start-yaml-problem').textContent.includes('resolution')")
    assert "is not a PNG or PGM image" in browser.text("#start-image-problem")
    assert browser.value("document.querySelector('#start-yaml').hasAttribute('aria-invalid')")
    assert browser.value("document.querySelector('#start-seed-problem').textContent") == ""
    assert browser.errors(network=False) == []

    yaml.write_text(YAML)
    room((48, 36)).save(image)
    browser.find("#start-yaml").send_keys(str(yaml))
    browser.find("#start-image").send_keys(str(image))
    choose(browser, planner="greedy", speed="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('.followed .badge')?.textContent === 'complete'")
    assert browser.text(".view > header h1") == "room"


def test_warnings_about_a_map_without_room_are_not_errors_of_the_yaml(
    browser: Browser, pages: Server, tmp_path: Path
) -> None:
    yaml, image = tmp_path / "room.yaml", tmp_path / "room.png"
    yaml.write_text(YAML)
    Image.new("L", (48, 36), 0).save(image)
    warned = "document.querySelector('form.start > [role=alert]').textContent.includes('warning: ')"
    upload(browser, pages, yaml, image)
    browser.wait(warned)
    assert browser.text("form.start > [role=alert]").startswith("no room")
    assert not browser.value("document.querySelector('#start-yaml').hasAttribute('aria-invalid')")

    browser.run(HELD)  # the preview's answer comes after that to the request for a mission, and does not replace it
    browser.run("document.querySelector('#start-image').dispatchEvent(new Event('change', { bubbles: true }))")
    browser.wait("Boolean(window.answer)")
    browser.click("form.start button.first")
    browser.wait(f"!document.querySelector('form.start button.first').disabled && {warned}")
    browser.run("window.answer()")
    browser.wait("!document.querySelector('.preview').innerText.includes('looking at the map')")
    assert browser.value(warned)


def test_a_dropped_map_is_shown_as_it_is_understood_before_it_is_explored(
    browser: Browser, pages: Server, tmp_path: Path
) -> None:
    leaking = Image.new("L", (48, 36), 0)
    leaking.paste(254, (2, 0, 46, 34))
    leaking.save(tmp_path / "room.png")
    (tmp_path / "room.yaml").write_text(YAML)
    browser.open(f"{pages.url}/")
    browser.wait("document.querySelectorAll('.classes li').length > 2")
    files = [[name, base64.b64encode((tmp_path / name).read_bytes()).decode()] for name in ("room.yaml", "room.png")]
    browser.run(DROP, [["notes.txt", ""]])
    assert "notes.txt is neither a yaml file nor" in browser.text("form.start > [role=alert]")
    browser.run(DROP, files[:1])
    browser.wait("document.querySelector('.hint').textContent === \"choose or drop the map's image\"")
    browser.run(DROP, files[1:])
    browser.wait("document.querySelector('.warnings').textContent.includes('leaks to the border')")
    assert "12.0 m × 9.0 m" in browser.text(".hint")
    assert browser.value("document.querySelector('#start-scenario').value") == ""
    assert len(browser.colours(".preview canvas")) > 4
    browser.run("document.querySelectorAll('.preview-tools > [aria-pressed]')[1].click()")
    for x, y in ((0.3, 0.2), (0.7, 0.2), (0.7, 0.8), (0.3, 0.8), (0.3, 0.2)):
        browser.run(PRESS, ".preview canvas", x, y)
    browser.wait("document.querySelector('.drawn').textContent === 'boundary1 ×'")
    choose(browser, planner="greedy", speed="")
    browser.click("form.start button.first")
    browser.wait("document.querySelector('.followed .badge')?.textContent === 'complete'")
    (zone,) = pages.ask("GET", f"/v1/missions/{browser.value('location.hash').rpartition('/')[2]}/zones").document[
        "zones"
    ]
    assert zone["kind"] == "explore"
    assert browser.errors() == []


def test_a_map_with_too_many_cells_is_made_coarser_by_one_click(
    browser: Browser, narrow: Server, tmp_path: Path
) -> None:
    room((96, 72)).save(tmp_path / "room.png")
    (tmp_path / "room.yaml").write_text(YAML)
    upload(browser, narrow, tmp_path / "room.yaml", tmp_path / "room.png")
    assert browser.text("#start-image-problem button") == "Use cells 2 times as large"
    browser.click("#start-image-problem button")
    browser.wait("document.querySelector('.hint').textContent.startsWith('24.0 m × 18.0 m')")
    assert browser.value("document.querySelector('#start-image-problem').textContent") == ""


def test_a_service_with_keys_requires_one_and_keeps_it_for_the_tab(browser: Browser, tmp_path: Path) -> None:
    key = KeyFile(tmp_path).add("fleet", ["plan", "mission"], 1, now_s=time.time())
    with Server(tmp_path, "--require-keys") as server:
        browser.open(f"{server.url}/", DESK)
        for text in ("guess", key):
            browser.find("#key-text").send_keys(text)
            browser.click("#key button")
            if text != key:
                browser.wait("document.querySelector('#key-notice').textContent.includes('unknown')")
        browser.wait("document.querySelector('#start-seed') && !document.querySelector('#key').open")
        assert browser.value("Object.keys(localStorage).length") == 0
        assert browser.value("Object.values(sessionStorage)") == [key]
        browser.click("#leave")
        browser.find("#key-text")
        assert browser.value("Object.keys(sessionStorage).length") == 0


@pytest.mark.parametrize(("view", "dark"), [(DESK, False), (PHONE, True)])
def test_every_word_of_the_start_page_can_be_read(browser: Browser, pages: Server, view: Any, dark: bool) -> None:
    browser.open(f"{pages.url}/", view, dark=dark)
    browser.find("#start-scenario")
    faint = browser.run(_FAINT)
    assert faint == []
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")


_FAINT = """
const parse = (css) => (css.match(/[\\d.]+/g) || []).map(Number);
const linear = (v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const light = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
const ground = (node) => {
  for (let one = node; one; one = one.parentElement) {
    const found = parse(getComputedStyle(one).backgroundColor);
    if (found.length && found[3] !== 0) return found;
  }
  return [255, 255, 255];
};
const faint = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const node = walker.currentNode.parentElement, text = walker.currentNode.textContent.trim();
  if (!text || !node.checkVisibility() || node.closest("option, dialog, script, noscript")) continue;
  const [a, b] = [light(parse(getComputedStyle(node).color)), light(ground(node))].sort((x, y) => y - x);
  const contrast = (a + 0.05) / (b + 0.05);
  if (contrast < 4.5 && !node.closest(":disabled")) faint.push(`${contrast.toFixed(2)} ${text}`);
}
return faint;
"""


def test_the_page_says_how_far_a_service_is_that_starts(browser: Browser, pages: Server) -> None:
    script = browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": STARTING})
    try:
        browser.open(f"{pages.url}/")
        browser.wait("document.querySelector('#connection').textContent.includes('compiling, 15 of 41 functions')")
        browser.run("window.starts = false")
        browser.wait("!document.querySelector('#connection').textContent")
        assert browser.errors() == []
    finally:
        browser.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)


def test_each_strategy_is_offered_with_its_idea(browser: Browser, pages: Server) -> None:
    browser.open(f"{pages.url}/")
    browser.find("#start-strategy")
    chosen = browser.value("document.querySelector('#start-strategy').selectedOptions[0].text")
    assert chosen == "temporal (recommended)"
    assert "guessed targets" in browser.text("form.start")
    choose(browser, strategy="assignment")
    assert "Hungarian assignment" in browser.text("form.start")
