from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from synthetic_mission import mission_started, synthetic_mission

from marsupial.formats.missionlog import parse_log
from marsupial.formats.triggers import read_triggers
from marsupial.model.mission import MissionEvent, Planned
from marsupial.replay.page import replay_page

EVENTS = synthetic_mission()
NASTY = "</script><script>alert(1)</script><!--<script> {{style}} & \" ' \u2028 \\"


class Outline(HTMLParser):
    """What a browser would make of the page: elements, their attributes, and the text of scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self._open: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        key = dict(self.elements[-1][1]).get("id") or self.elements[-1][0] if self.elements else ""
        if self._open and self._open[-1] == self.elements[-1][0]:
            self.texts[str(key)] = self.texts.get(str(key), "") + data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


def logged(page: str) -> tuple[MissionEvent, ...]:
    """Return the events that stand in the page."""
    return parse_log(Outline(page).texts["log"].strip().encode("ascii")).events


@pytest.fixture(scope="module")
def page() -> str:
    return replay_page(EVENTS)


def test_the_log_in_the_page_is_the_mission(page: str) -> None:
    assert logged(page) == EVENTS


def test_every_slot_of_the_template_is_filled(page: str) -> None:
    assert not re.search(r"\{\{\w+\}\}", page)


def test_the_page_needs_nothing_from_elsewhere(page: str) -> None:
    outline = Outline(page)
    sources = [attributes.get(name) for _, attributes in outline.elements for name in ("src", "href", "action")]
    assert [source for source in sources if source is not None] == ["data:,"]
    assert not re.search(r"https?://|@import|url\(", page)
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|EventSource|importScripts)\b", page)


def test_the_page_forbids_the_browser_to_load_anything(page: str) -> None:
    policy = next(meta["content"] for meta in Outline(page).all("meta") if meta.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none';")


def test_the_page_is_made_of_one_style_one_log_and_one_script(page: str) -> None:
    outline = Outline(page)
    assert len(outline.all("style")) == 1
    assert [script.get("id") for script in outline.all("script")] == ["log", None]


def test_every_control_has_a_name_for_those_who_do_not_see_it(page: str) -> None:
    outline = Outline(page)
    for button in outline.all("button"):
        assert button.get("aria-label") or button.get("id") == "save"
    for canvas in outline.all("canvas"):
        assert canvas.get("role") == "img"
        assert canvas.get("aria-label")
    assert Outline(page).all("html")[0]["lang"] == "en"


def test_every_element_the_script_asks_for_is_there(page: str) -> None:
    outline = Outline(page)
    ids = [attributes["id"] for _, attributes in outline.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'byId\("([\w-]+)"\)', page)) <= set(ids)


def test_every_colour_the_script_asks_for_has_a_light_and_a_dark_side(page: str) -> None:
    light, dark = (set(re.findall(r"--([\w-]+):", part)) for part in re.findall(r":root[^{]*\{([^}]*)\}", page)[:2])
    assert light - dark == {"target", "meeting"}  # the same on both
    assert set(re.findall(r'themeColour\("([\w-]+)"\)', page)) <= light


@pytest.mark.parametrize("field", ["scenario", "strategy", "planner"])
def test_no_text_in_the_log_can_become_markup(field: str) -> None:
    events = (replace(mission_started(), **{field: NASTY}), *EVENTS[1:])
    page = replay_page(events)
    assert logged(page) == events
    assert Outline(page).all("script") == Outline(replay_page(EVENTS)).all("script")


def test_the_title_is_escaped() -> None:
    page = replay_page([replace(mission_started(), scenario=NASTY)])
    assert "<title>&lt;/script&gt;&lt;script&gt;" in page


def test_a_reason_in_the_log_can_hold_anything() -> None:
    plan = next(event for event in EVENTS if isinstance(event, Planned))
    events = (mission_started(), replace(plan, trigger=read_triggers(NASTY)))
    assert logged(replay_page(events)) == events


def test_a_log_without_an_end_makes_a_page() -> None:
    assert logged(replay_page(EVENTS[:7])) == EVENTS[:7]


def test_the_same_events_make_the_same_page(page: str) -> None:
    assert replay_page(list(EVENTS)) == page
