"""Missions side by side in a replay page, in a browser."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from played_pages import EVENTS, OTHER, PRESS, drawn, hover, place_under, written
from support.missions.synthetic_mission import mission_started
from support.pictures.browser import DESK, Browser, View

from marsupial.model.mission import Revealed


def test_two_missions_share_a_clock_and_a_sentence_states_their_difference(browser: Browser, tmp_path: Path) -> None:
    ended = EVENTS[-1]
    explored = (*EVENTS[:-1], replace(ended, exploration_ms=12_400, known_ms=((90, 9_000),)))
    slower = (*OTHER[:-1], replace(ended, exploration_ms=15_600, known_ms=((90, 7_000),)))
    browser.open(written(tmp_path, slower, explored) + "#t=14")
    sentence = browser.text(".difference b")
    ending = "explored all 0:04 later (0:16) and ended no sooner (0:26)"
    assert sentence == f"heuristic knew 90 % 0:02 sooner (0:07), {ending} than temporal."
    browser.open(written(tmp_path, explored, slower) + "#t=14")
    sentence = browser.text(".difference b")
    ending = "explored all 0:04 sooner (0:12) and ended no sooner (0:26)"
    assert sentence == f"temporal knew 90 % 0:02 later (0:09), {ending} than heuristic."
    assert browser.value("document.querySelectorAll('.transport').length") == 1
    labels = browser.value("[...document.querySelectorAll('canvas.map')].map((one) => one.getAttribute('aria-label'))")
    assert labels[0].replace("temporal", "heuristic") == labels[1]


def test_what_one_mission_alone_knows_at_the_moment_is_tinted_in_its_colour(browser: Browser, tmp_path: Path) -> None:
    blind = tuple(event for event in OTHER if not isinstance(event, Revealed) or event.t_ms < 5_000)
    browser.open(written(tmp_path, EVENTS, blind) + "#t=3&theme=light")
    browser.wait("document.querySelectorAll('canvas.floor')[1]?.width > 100")
    browser.run("document.querySelectorAll('canvas.floor').forEach((one, i) => one.id = `floor${i}`)")
    drawn(browser)

    def colours() -> list[set[str]]:
        drawn(browser)
        return [{name for name, count in browser.colours(f"#floor{i}").items() if count > 50} for i in (0, 1)]

    alike = colours()
    assert alike[0] == alike[1]
    assert browser.text(".known").endswith(", 0.0 m² here only")
    for moment in ("t=20", "t=3", "t=20"):
        browser.run("location.hash = arguments[0]", moment)
        browser.wait(f"document.querySelector('.clock').innerText.startsWith('0:{int(moment[2:]):02}')")
        first, second = colours()
        assert len(first - second) == (moment == "t=20")  # ground that the other one has not seen
        assert second <= first
    texts = browser.value("[...document.querySelectorAll('.known')].map((one) => one.textContent)")
    (known, alone), (other, none) = (map(float, re.findall(r"[\d.]+", text)) for text in texts)
    assert (alone, none) == (pytest.approx(known - other, abs=0.15), 0)
    browser.run("location.hash = 't=20&alone=0'")
    browser.wait("!document.querySelector('.layers label:last-child input').checked")
    first, second = colours()
    assert first == second


def test_maps_side_by_side_have_one_scale_and_place(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS[:6], OTHER) + "#t=26&play=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    before = place_under(browser, 0)
    assert place_under(browser, 1) == before
    browser.click(".pane:last-child .zoom button")
    assert place_under(browser, 0) == place_under(browser, 1) != before


def test_maps_of_other_frames_have_cameras_of_their_own(browser: Browser, tmp_path: Path) -> None:
    moved = (replace(mission_started(), origin_m=(5.0, 0.0, 0.0), strategy="heuristic"), *EVENTS[1:])
    browser.open(written(tmp_path, EVENTS, moved) + "#t=26&play=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    before = place_under(browser, 0)
    browser.click(".pane:last-child .zoom button")
    assert place_under(browser, 0) == before


def test_a_robot_of_one_mission_is_followed_in_all_until_another_map_is_moved(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS, OTHER) + "#t=11&play=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    drawn(browser)
    browser.run(PRESS, "canvas.map", *hover(browser, "canvas.map", "rover1_1")[1:])
    browser.click(".picked .follow")
    assert browser.text(".pane:first-child .following") == "following rover1_1 ×"
    assert place_under(browser, 0) == place_under(browser, 1)
    browser.click(".pane:last-child .zoom button")
    browser.wait("document.querySelector('.following').hidden")


def test_side_by_side_it_is_told_who_ended_first_and_when_most_was_known(browser: Browser, tmp_path: Path) -> None:
    ended = replace(EVENTS[-1], known_ms=((50, 9_000), (90, 20_000), (99, None)))
    browser.open(written(tmp_path, (*EVENTS[:-1], ended), OTHER[:-1]) + "#t=26&play=0")
    assert browser.text(".difference b") == "temporal ended first, at 0:26; heuristic goes on."
    assert browser.text(".times").splitlines() == ["50 % known at 0:09", "90 % known at 0:20", "99 % never"]
    bars = browser.value(
        "[...document.querySelectorAll('.times > *')].map((one) => parseFloat(one.style.cssText.split(': ')[1]))"
    )
    assert bars == [pytest.approx(100 * ms / EVENTS[-1].t_ms, rel=1e-3) for ms in (9_000, 20_000, 0)]
    browser.click(".times button")
    browser.wait("document.querySelector('.clock').innerText.startsWith('0:09.0')")
    browser.open(written(tmp_path, (*EVENTS[:-1], ended)) + "#t=99&play=0")
    assert "50 / 90 / 99 % known at 0:09 / 0:20 / never" in browser.text("aside")


def test_pointing_at_the_curves_tells_what_each_knows_then(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS, OTHER) + "#t=26&play=0")
    browser.wait("document.querySelector('canvas.moment')?.width > 100")
    told = hover(browser, "canvas.moment", "0:")[0]
    assert "temporal: " in told
    assert told.count("% known") == 2


def test_the_legend_lies_beside_the_maps_or_closes_with_a_click_on_them(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    isopen = "document.querySelector('.legend').open"
    over = "document.querySelector('main').getBoundingClientRect().right > "
    over += "document.querySelector('.legend .card').getBoundingClientRect().left"
    for view, is_over in ((DESK, False), (View(1000, 700), True)):
        browser.open(written(tmp_path, EVENTS, OTHER) + "#t=14&play=0", view)
        browser.click(".legend summary")
        assert browser.value(over) == is_over
        assert "beside a robot: it waits" in browser.text(".legend")
        ActionChains(browser.driver).send_keys(Keys.ESCAPE).perform()
        assert not browser.value(isopen)
        browser.click(".legend summary")
        browser.click(".pane:first-child .map")
        assert browser.value(isopen) != is_over


LOWEST = """
const row = (canvas, high) => new Set(new Uint32Array(
  canvas.getContext("2d").getImageData(0, canvas.height - high, canvas.width, high).data.buffer)).size;
return [row(document.querySelector("canvas.floor"), 8), row(document.querySelector("canvas.map"), 16)];
"""
"""Return the number of colours at the lower edge of the first map: of its ground, and of what stands on it."""


def test_a_map_below_a_form_is_seen_whole_and_with_its_scale(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS, OTHER) + "#t=26&play=0", View(1024, 560))
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    browser.run(
        "const form = document.createElement('p'); form.style.height = '60px';"
        "document.querySelector('.pane').prepend(form)"
    )
    drawn(browser)
    ground, signs = browser.run(LOWEST)
    assert ground == 1, "there is a margin below the map"
    assert signs > 1, "the scale bar is seen"
