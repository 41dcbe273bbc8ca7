"""A replay page in a browser."""

from dataclasses import replace
from pathlib import Path

import pytest
from played_pages import EVENTS, OTHER, PRESS, WHERE, drawn, hover, place_under, written
from support.missions.battery_yard import battery_yard
from support.missions.faulty_mission import explored, yard
from support.missions.synthetic_mission import mission_started
from support.pictures.browser import DESK, PHONE, Browser, View

from marsupial.model import Planned, Role, Status
from marsupial.model.mission import ActionStarted, ContactLost
from marsupial.replay.palette import DARK, LIGHT

UNDER = """
const canvas = document.querySelector("canvas.floor"), cover = document.querySelector(arguments[0]);
const stage = canvas.getBoundingClientRect(), box = cover.getBoundingClientRect(), ratio = canvas.width / stage.width;
const corner = [box.left - stage.left, box.top - stage.top, box.width, box.height].map((v) => Math.round(v * ratio));
return new Set(new Uint32Array(canvas.getContext("2d").getImageData(...corner).data.buffer)).size;
"""
"""Return the number of ground colours under an element."""


@pytest.mark.parametrize(("view", "dark"), [(DESK, False), (PHONE, True)], ids=["light, on a desk", "dark, on a phone"])
def test_one_mission_and_two_are_drawn_without_console_messages(
    browser: Browser, tmp_path: Path, view: View, dark: bool
) -> None:
    palette = DARK if dark else LIGHT
    for missions in ((EVENTS,), (EVENTS, OTHER)):
        browser.open(written(tmp_path, *missions) + "#t=14", view, dark=dark)
        browser.wait("document.querySelector('canvas.floor')?.width > 100")
        drawn(browser)
        ground = browser.colours("canvas.floor")
        assert {f"{colour}ff" for colour in (palette.unknown, palette.free, palette.wall, palette.other)} <= set(ground)
        assert f"{palette.families[0][0]}ff" in browser.colours("canvas.map")
        assert len(browser.colours("canvas.still")) > 10
        assert browser.value("document.documentElement.scrollWidth") <= view.width
        assert browser.errors() == []


def test_it_opens_playing(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS))
    assert browser.wait("document.querySelector('.play')?.getAttribute('aria-label')") == "Pause"
    browser.wait("Number(document.querySelector('input[type=range]').value) > 100")


def test_with_reduced_motion_it_opens_paused_at_a_moment_with_robots_out(browser: Browser, tmp_path: Path) -> None:
    browser.look(DESK)
    features = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
    browser.driver.get(written(tmp_path, EVENTS))
    assert browser.wait("document.querySelector('.play')?.getAttribute('aria-label')") == "Play"
    browser.wait(
        "document.querySelector('canvas.map').getAttribute('aria-label').includes('2 of 3 robots on the ground')"
    )


def test_the_stop_report_stands_there_at_the_end_only(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=14")
    assert browser.text(".badge") == "under way"
    assert "STOP REPORT" not in browser.text("aside")
    browser.run(
        "const s = document.querySelector('input[type=range]'); s.value = s.max; s.dispatchEvent(new Event('input'));"
    )
    browser.wait("document.querySelector('aside').innerText.includes('STOP REPORT')")
    assert browser.text(".badge") == "stalled"
    assert "of 132 m² in reach" in browser.text(".known")


def test_scrubbing_back_shows_what_was_known_then(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=3")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    drawn(browser)
    before, known = browser.colours("canvas.floor"), browser.text(".known")
    for t in (26, 3):
        browser.run("location.hash = 't=' + arguments[0]", t)
        browser.wait(f"document.querySelector('.clock').innerText.startsWith('0:{t:02}')")
        drawn(browser)
    assert browser.colours("canvas.floor") == before
    assert browser.text(".known") == known


def test_hovering_shows_a_robot_s_action_its_reason_and_its_result(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=11")
    browser.wait("document.querySelector('canvas.map')?.width > 100")
    drawn(browser)
    told = hover(browser, "canvas.map", "rover1_1")[0]
    assert "explores T1" in told
    assert "plan 1 at 0:00: the mission begins" in told
    assert "decided by temporal with planner greedy" in told
    assert "outcome" not in told, "it is not over yet"
    told = hover(browser, "canvas.moment", "rover1_1\n\nexplores T1")[0]
    assert "outcome: given up for the next plan" in told


def test_a_click_on_a_target_shows_which_robots_reach_it(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains

    browser.open(written(tmp_path, EVENTS) + "#t=11")
    browser.wait("document.querySelector('canvas.map')?.width > 100")
    drawn(browser)
    _, x, y = hover(browser, "canvas.map", "Target T1")
    canvas = browser.find("canvas.map")
    dx, dy = x - canvas.size["width"] // 2, y - canvas.size["height"] // 2
    ActionChains(browser.driver).move_to_element_with_offset(canvas, dx, dy).click().perform()
    card = browser.text(".picked")
    assert "t1 in the log" in card
    assert "rovers can explore it" in card
    assert "carriers cannot" in card
    assert "rover1_1 goes there by plan 1: there at 0:17" in card


@pytest.mark.parametrize("view", [DESK, PHONE])
def test_the_map_is_fitted_where_nothing_stands_on_it(browser: Browser, tmp_path: Path, view: View) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=99", view)
    browser.wait("document.querySelector('.known')?.textContent.includes('in reach')")
    drawn(browser)
    for cover in (".known", ".zoom"):
        assert browser.run(UNDER, cover) == 1, f"the map is under {cover}"


def test_a_robot_is_followed_from_its_card_until_the_whole_map_is_asked_for(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=11")
    browser.click("tbody tr:nth-child(2) button")
    browser.click(".picked .follow")
    assert browser.text(".following") == "following rover1_1 ×"
    browser.click(".zoom button:last-child")
    browser.wait("document.querySelector('.following').hidden")


def test_escape_from_following_shows_again_what_was_seen_before(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    browser.open(written(tmp_path, EVENTS) + "#t=11&play=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    for zooms in (0, 1):
        for _ in range(zooms):
            browser.click(".zoom button")
        drawn(browser)
        before = place_under(browser, 0)
        browser.click("tbody tr:nth-child(2) button")
        browser.click(".picked .follow")
        drawn(browser)
        assert place_under(browser, 0) != before
        ActionChains(browser.driver).send_keys(Keys.ESCAPE).perform()
        assert place_under(browser, 0) == before


def test_a_sentence_tells_what_happens_now_and_next(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=3")
    assert browser.text(".now") == "carrier1 drives to M1, then sets down rover1_1"
    browser.open(written(tmp_path, EVENTS) + "#t=99")
    browser.wait("document.querySelector('.now')?.textContent.startsWith('stalled: ')")


@pytest.mark.parametrize("missions", [1, 2, 3])
def test_the_map_has_most_of_the_height(browser: Browser, tmp_path: Path, missions: int) -> None:
    browser.open(written(tmp_path, *[EVENTS, OTHER, EVENTS][:missions]) + "#t=14")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    assert browser.value("document.querySelector('.stage').clientHeight > 0.6 * innerHeight")
    browser.click(".opener")
    assert browser.value("document.querySelector('.opener').ariaExpanded") == "true"
    assert browser.value("document.querySelector('canvas.moment').tabIndex") == 0, "keys scroll the lanes"
    assert browser.errors() == []


def test_keys_play_and_step_and_every_control_has_a_name(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains

    browser.open(written(tmp_path, EVENTS) + "#t=14")
    browser.wait("document.querySelector('.clock')?.innerText.startsWith('0:14')")
    ActionChains(browser.driver).send_keys("[").perform()
    browser.wait("document.querySelector('.clock').innerText.startsWith('0:12.5')")
    ActionChains(browser.driver).send_keys(" ").perform()
    browser.wait("document.querySelector('.play').getAttribute('aria-label') === 'Pause'")
    controls = "[...document.querySelectorAll('button, input, select')]"
    nameless = f"{controls}.filter((one) => !(one.textContent || one.ariaLabel || one.labels?.length)).length"
    assert browser.value(nameless) == 0
    pictures = (
        "[...document.querySelectorAll('canvas')].filter((one) => one.ariaHidden !== 'true' && !one.ariaLabel).length"
    )
    assert browser.value(pictures) == 0


def test_zones_are_drawn_while_they_hold(browser: Browser, tmp_path: Path) -> None:
    corners = "polygon_m: [[10, 0], [14, 0], [14, 5]]"
    closed = f"{{name: a, kind: no_go, {corners}, from_s: 5, until_s: 9}}"
    _, events = explored(yard(f"zones: [{closed}, {{name: b, kind: explore, {corners}}}]\n"))
    for seconds, shown in ((3, "area to explore b"), (7, "no-go zone a"), (10, "area to explore b")):
        browser.open(written(tmp_path, events) + f"#t={seconds}")
        browser.wait("document.querySelector('canvas.floor')?.width > 100")
        drawn(browser)
        text = browser.run(WHERE, shown)
        assert text is not None
        assert ("no-go zone a" in text) == (seconds == 7)
        assert browser.errors() == []


@pytest.mark.parametrize("view", [DESK, PHONE])
def test_charges_and_charging_places_are_shown(browser: Browser, tmp_path: Path, view: View) -> None:
    _, events = explored(battery_yard())
    browser.open(written(tmp_path, events) + "#t=20", view)
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    drawn(browser)
    cells = browser.value("[...document.querySelectorAll('td.charge')].map((one) => [one.textContent, one.title])")
    last = [event for event in events if isinstance(event, Planned) and event.t_ms <= 20_000][-1]
    for (text, title), (_, share) in zip(cells, last.charges, strict=True):
        assert text.removeprefix("↑ ") == f"{share * 100:.0f} %"
        assert ("charges aboard" in title or "charges at a charging place" in title) == text.startswith("↑")
    assert any(text.startswith("↑") for text, _ in cells)
    assert browser.value("[...document.querySelectorAll('td')].every((one) => one.scrollWidth <= one.clientWidth + 1)")
    assert browser.run(WHERE, "charging place") is not None
    assert "battery" in hover(browser, "canvas.map", "c2")[0]
    browser.click(".legend summary")
    assert "charging place" in browser.text(".legend")
    assert browser.errors() == []


def test_a_drive_back_without_contact_is_told_as_such(browser: Browser, tmp_path: Path) -> None:
    scenario = yard("")
    kinds = (replace(k, radio_range_m=1.0) if k.role is Role.ROVER else k for k in scenario.robot_types)
    _, events = explored(replace(scenario, robot_types=tuple(kinds)), "heuristic")
    back = next(e for e in events if isinstance(e, ActionStarted) and not e.action.duration_ms)
    away = next(e for e in events if isinstance(e, ContactLost) and e.robot == back.action.robot)
    browser.open(f"{written(tmp_path, events)}#t={back.t_ms / 1000 + 1}&play=0")
    row = next(row for row in browser.find("table.team").find_elements("css selector", "tr") if away.robot in row.text)
    assert "no contact: drives to M" in row.text
    row.find_element("css selector", "button").click()
    card = browser.text(".picked")
    assert f"expected at 0:{away.wait_ms / 1000:02.0f}" in card
    assert "planned until" not in card
    assert "not by a plan" in card


@pytest.mark.parametrize("missions", [1, 2])
def test_a_long_name_widens_no_page(browser: Browser, tmp_path: Path, missions: int) -> None:
    named = (replace(mission_started(), scenario="a very long name of a mission " * 3), *EVENTS[1:])
    browser.open(written(tmp_path, *[named] * missions) + "#t=14", PHONE)
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    assert browser.value("document.documentElement.scrollWidth") <= PHONE.width


def test_a_mission_that_was_called_back_is_not_called_cancelled(browser: Browser, tmp_path: Path) -> None:
    ended = replace(EVENTS[-1], status=Status.CANCELLED, reason="called back by the operator, all rovers are aboard")
    browser.open(written(tmp_path, (*EVENTS[:-1], ended)) + "#t=99")
    browser.wait("document.querySelector('.badge')?.textContent === 'called back'")
    assert browser.text(".now") == "called back by the operator, all rovers are aboard"


def test_names_of_robots_are_not_cut(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=14&play=0")
    browser.click("tbody tr:nth-child(2) button")
    assert browser.value("[...document.querySelectorAll('.team button')].every((b) => b.scrollWidth <= b.clientWidth)")


@pytest.mark.parametrize("missions", [1, 2])
def test_the_card_is_small_and_covers_nothing_that_is_chosen(browser: Browser, tmp_path: Path, missions: int) -> None:
    browser.open(written(tmp_path, *[EVENTS, OTHER][:missions]) + "#t=11&play=0")
    browser.wait("document.querySelector('canvas.map')?.width > 100")
    browser.click(".opener")
    drawn(browser)
    for thing in ("rover1_1", "carrier1", "Target T1"):
        _, x, y = hover(browser, "canvas.map", thing)
        browser.run(PRESS, "canvas.map", x, y)
        browser.wait(f"document.querySelector('.picked b').textContent.startsWith({thing!r})")
        drawn(browser)
        left, top, wide, high, lines = browser.value(
            "[...['offsetLeft', 'offsetTop', 'offsetWidth', 'offsetHeight']"
            ".map((name) => document.querySelector('.picked')[name]),"
            " document.querySelector('.lines').clientHeight / parseFloat(getComputedStyle(document.body).lineHeight)]"
        )
        assert not (left <= x <= left + wide and top <= y <= top + high), thing
        width, height = browser.value("['clientWidth', 'clientHeight'].map((n) => document.querySelector('.stage')[n])")
        assert wide <= 0.4 * width + 1
        assert high <= 0.5 * height
        assert lines == pytest.approx(round(lines), abs=0.06)  # none is cut


def test_space_plays_after_a_click_on_a_button_and_presses_what_keys_came_to(browser: Browser, tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    state = "[document.querySelector('.play').ariaLabel, document.querySelector('.opener').ariaExpanded]"
    browser.open(written(tmp_path, EVENTS) + "#t=14&play=0")
    browser.click(".opener")
    for plays in ("Pause", "Play"):
        ActionChains(browser.driver).send_keys(" ").perform()
        assert browser.value(state) == [plays, "true"]
    browser.click(".speed select")
    browser.click(".speed select")
    ActionChains(browser.driver).send_keys(Keys.TAB, " ").perform()
    assert browser.value(state) == ["Play", "false"]
