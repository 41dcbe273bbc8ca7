"""What a replay page tells of plans, in a browser."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from played_pages import EVENTS, WHERE, drawn, hover, planned_later, written
from support.pictures.browser import Browser

from marsupial.model import Action, ActionName, Cell, GuessedGround, MissionEvent, Planned
from marsupial.replay.palette import LIGHT


def reasoned(mission: Sequence[MissionEvent]) -> tuple[MissionEvent, ...]:
    """Return a mission whose first plan has reasons."""
    guess = GuessedGround(corner=Cell(0, 0), side=15, halls=(Cell(0, 2),), rooms=(Cell(3, 2),))
    why = {
        "guess": guess,
        "compared": (("auto", 60_000, 0), ("previous", 73_000, 0), ("greedy", 90_000, 1)),
        "instead": (("carrier1", ("t1", "m1")), ("rover1_2", ())),
    }
    return tuple(
        replace(event, **why) if isinstance(event, Planned) and event.revision == 1 else event for event in mission
    )


def test_ground_that_is_guessed_is_tinted_while_it_is_unknown(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, reasoned(EVENTS)) + "#t=3&play=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    drawn(browser)
    tinted = browser.colours("canvas.floor")
    assert browser.run(WHERE, "unknown · guessed: carriers can explore it") is not None
    assert browser.run(WHERE, "unknown · guessed: only rovers can explore it") is not None
    browser.open(written(tmp_path, reasoned(EVENTS)) + "#t=3&play=0&guess=0")
    browser.wait("document.querySelector('canvas.floor')?.width > 100")
    drawn(browser)
    plain = browser.colours("canvas.floor")
    assert sum(tinted.values()) == sum(plain.values())
    assert tinted[f"{LIGHT.unknown}ff"] < plain[f"{LIGHT.unknown}ff"]
    assert browser.run(WHERE, "guessed") is None


def test_the_plans_compared_are_told_with_their_prices_and_the_second_one_is_drawn(
    browser: Browser, tmp_path: Path
) -> None:
    browser.open(written(tmp_path, reasoned(EVENTS)) + "#t=3&play=0")
    drawn(browser)
    before = browser.colours("canvas.map")
    browser.click(".compared summary")
    rows = browser.value("[...document.querySelectorAll('.prices tbody tr')].map((one) => one.innerText)")
    assert rows == ["auto\t1:00", "the plan before\t0:13 higher", "planner greedy\tleaves out 1 target"]
    drawn(browser)
    assert browser.colours("canvas.map") != before
    browser.click("tbody tr:nth-child(1) button")
    card = browser.text(".picked")
    assert "then sets down rover1_1 at M1 at 0:05" in card
    assert "the next best plan (the plan before, 0:13 higher) would have it go to T1, then M1" in card
    browser.click("tbody tr:nth-child(3) button")
    browser.wait("document.querySelector('.picked').innerText.includes('0:13 higher) would have it do nothing')")
    browser.click(".legend summary")
    assert "next best plan" in browser.text(".legend")
    assert browser.errors() == []


def test_the_list_of_plans_stays_under_the_pointer(browser: Browser, tmp_path: Path) -> None:
    browser.open(written(tmp_path, EVENTS) + "#t=3&play=0")
    browser.click("details:has(.plans) summary")
    top = "document.querySelector('.plans').getBoundingClientRect().top"
    before = browser.value(top)
    for button in browser.driver.find_elements("css selector", ".plans button"):
        button.click()
        drawn(browser)
        assert browser.value(top) == before


def test_why_two_robots_go_to_one_target_is_told(browser: Browser, tmp_path: Path) -> None:
    along = Action(
        name=ActionName.EXPLORE, start_ms=10_002, duration_ms=9_000, robot="carrier1", place="t1", origin="m1"
    )
    browser.open(written(tmp_path, planned_later(EVENTS, along)) + "#t=7&play=0")
    assert browser.text(".now").endswith("then goes along to T1 in the east: unknown ground behind it is guessed")
    browser.click(".opener")
    drawn(browser)
    assert "unknown ground behind it is guessed" in hover(browser, "canvas.moment", "carrier1\n\ngoes along to T1")[0]
    assert "guessed" not in hover(browser, "canvas.moment", "rover1_1\n\nexplores T1")[0]
