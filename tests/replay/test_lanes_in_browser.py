"""The lanes of a replay page in a browser."""

from pathlib import Path

import pytest
from played_pages import EVENTS, OTHER, OVER, PRESS, drawn, hover, planned_later, written
from support.pictures.browser import Browser, View

from marsupial.model import Action, ActionName


def test_what_is_chosen_on_the_lanes_is_chosen_everywhere(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS, OTHER) + "#t=3")
    browser.click(".opener")
    _, x, y = hover(browser, "canvas.moment", "rover1_1")
    browser.run(PRESS, "canvas.moment", x, y)
    browser.wait("document.querySelectorAll('.picked:not([hidden])').length === 2")
    titles = browser.value("[...document.querySelectorAll('.picked b')].map((one) => one.textContent)")
    assert titles == ["rover1_1 (rover)"] * 2
    assert set(browser.value("[...document.querySelectorAll('.now')].map((one) => one.textContent.split(' ')[0])")) == {
        "rover1_1"
    }
    browser.open(written(tmp_path, EVENTS) + "#t=11")
    browser.run(PRESS, "canvas.map", *hover(browser, "canvas.map", "rover1_1")[1:])
    browser.wait("document.querySelector('tbody tr:nth-child(2) button').ariaPressed === 'true'")


def test_open_lanes_show_the_plan_of_the_moment(browser: Browser, tmp_path: Path) -> None:
    dock = Action(
        name=ActionName.DOCK, start_ms=20_000, duration_ms=5_000, robot="rover1_1", place="m1", carrier="carrier1"
    )
    browser.open(written(tmp_path, planned_later(EVENTS, dock)) + "#t=11&play=0")
    browser.click(".opener")
    drawn(browser)
    told = hover(browser, "canvas.moment", "rover1_1\n\nboards carrier1")[0]
    assert "0:20 to 0:25 by plan 1" in told
    told = hover(browser, "canvas.moment", "carrier1\n\npicks up rover1_1")[0]
    assert "waits for rover1_1 from 0:10 on" in told
    assert browser.errors() == []


def test_open_lanes_show_what_came_later_only_without_the_plan(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains

    boards = "rover1_1\n\nboards carrier1"  # which no plan has yet
    browser.open(written(tmp_path, EVENTS) + "#t=11&play=0")
    browser.click(".opener")
    drawn(browser)
    assert browser.run(OVER, "canvas.moment", boards) is None
    ActionChains(browser.driver).send_keys("p").perform()
    drawn(browser)
    hover(browser, "canvas.moment", boards)


def test_open_lanes_have_room_for_all_robots_or_scroll_between_curve_and_axis(browser: Browser, tmp_path: Path) -> None:
    rest = "document.querySelector('.lanes-box').scrollHeight - document.querySelector('.lanes-box').clientHeight"
    browser.open(written(tmp_path, *[EVENTS, OTHER] * 2) + "#t=99")  # 12 robots
    browser.click(".opener")
    drawn(browser)
    assert browser.value(rest) == 0
    browser.open(written(tmp_path, *[EVENTS, OTHER] * 3) + "#t=99", View(1200, 560))
    browser.click(".opener")
    drawn(browser)
    assert browser.value(rest) > 0
    hover(browser, "canvas.moment", "0:")  # what is known
    assert browser.run(OVER, "canvas.moment", "rover1_2")[2] < 200
    browser.run(f"document.querySelector('.lanes-box').scrollTop = {rest}")
    drawn(browser)
    hover(browser, "canvas.moment", "0:")
    hover(browser, "canvas.moment", "Plan ")
    tops = browser.value(
        "['.lanes-box', 'canvas.moment'].map((s) => document.querySelector(s).getBoundingClientRect().top)"
    )
    assert tops[0] == tops[1]


@pytest.mark.parametrize("lanes", ["closed", "open"])
def test_lanes_show_for_whom_a_robot_waited_and_how_long(browser: Browser, tmp_path: Path, lanes: str) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=99")
    if lanes == "open":
        browser.click(".opener")
    drawn(browser)
    told, x, y = hover(browser, "canvas.moment", "carrier1\n\nwaits for rover1_1, 0:06, from 0:10 to 0:16")
    assert "rover1_1 explores T1" in told
    bottom = browser.value("document.querySelector('.tip').getBoundingClientRect().bottom")
    top = browser.value("document.querySelector('canvas.moment').getBoundingClientRect().top")
    assert bottom <= top + y + 1  # above the first lane
    line = browser.run(
        "const canvas = document.querySelector('canvas.still');"
        "const data = canvas.getContext('2d').getImageData(arguments[0], arguments[1] - 9, 40, 18).data;"
        "return new Set(new Uint32Array(data.buffer)).size;",
        *(x, y),
    )
    assert line > 2  # dots on the card, besides the lines between lanes
