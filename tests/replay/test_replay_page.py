import gzip
import json
import re
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from support.missions.synthetic_mission import mission_started, synthetic_mission
from support.pictures.colour_vision import contrast

from marsupial.formats.loglines import read_triggers
from marsupial.formats.missionlog import parse_log
from marsupial.model.mission import MissionEvent, Planned
from marsupial.replay.page import LAYERS, LIVE, file_text, module_texts, page_style, replay_page

EVENTS = synthetic_mission()
NASTY = "</script><script>alert(1)</script><!--<script> {{style}} & \" ' \u2028 \\"


class Outline(HTMLParser):
    """The elements of the page, their attributes, and the text of scripts."""

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


def logged(page: str) -> list[tuple[MissionEvent, ...]]:
    """Return the events of each mission that stands in the page."""
    return [parse_log(log).events for log in unpacked(page, "log")]


def unpacked(page: str, kind: str) -> list[bytes]:
    found = re.findall(rf'<script type="application/gzip" class="{kind}">(.*?)</script>', page, re.DOTALL)
    return [gzip.decompress(b64decode(text)) for text in found]


@pytest.fixture(scope="module")
def page() -> str:
    return replay_page(EVENTS)


def test_the_log_in_the_page_is_the_mission(page: str) -> None:
    assert logged(page) == [EVENTS]


def test_every_slot_of_the_template_is_filled(page: str) -> None:
    assert not re.search(r"\{\{\w+\}\}", page)


def test_the_page_needs_nothing_from_elsewhere(page: str) -> None:
    outline = Outline(page)
    sources = [attributes.get(name) for _, attributes in outline.elements for name in ("src", "href", "action")]
    assert [source for source in sources if source is not None] == ["data:,"]
    texts = page + "".join(module_texts(*LAYERS).values())
    names = texts.replace('"http://www.w3.org/2000/svg"', "")  # a namespace, which is not loaded
    assert not re.search(r"https?://|@import|url\(", names)
    assert not re.search(r"\b(fetch|XMLHttpRequest|WebSocket|EventSource|importScripts)\b", texts)


def test_the_page_forbids_the_browser_to_load_anything(page: str) -> None:
    policy = next(meta["content"] for meta in Outline(page).all("meta") if meta.get("http-equiv"))
    assert policy.startswith("default-src 'none';")


def test_the_page_is_made_of_one_style_one_script_its_modules_and_a_log_for_each_mission(page: str) -> None:
    for made, logs in ((page, 1), (replay_page(EVENTS, EVENTS[:7]), 2)):
        outline = Outline(made)
        assert len(outline.all("style")) == 1
        assert [script.get("class") for script in outline.all("script")] == ["modules"] + ["log"] * logs + [None]
        assert outline.all("html")[0]["lang"] == "en"


def test_two_missions_are_both_in_the_page_and_in_its_title() -> None:
    other = (replace(mission_started(), strategy="heuristic"), *EVENTS[1:])
    page = replay_page(EVENTS, other)
    assert logged(page) == [EVENTS, other]
    assert "<title>two halves: temporal, seed 1 and two halves: heuristic, seed 1</title>" in page


def test_the_page_holds_the_modules_as_they_are(page: str) -> None:
    (modules,) = unpacked(page, "modules")
    assert json.loads(modules) == {f"#{name}": text for name, text in module_texts(*LAYERS).items()}
    assert "</script" not in file_text("file.js")


def test_modules_import_each_other_by_names_that_exist() -> None:
    texts = module_texts(*LAYERS, LIVE)
    for name, text in texts.items():
        sources = re.findall(r'^(?:import|\}) .*?from "(.*)";$', text, re.MULTILINE)
        assert {source.removeprefix("#") for source in sources} <= texts.keys(), name


def test_every_colour_the_script_asks_for_has_a_light_and_a_dark_side(page: str) -> None:
    style, scripts = page_style(), "".join(module_texts(*LAYERS).values())
    light, dark = (
        {name for part in re.findall(selector + r" \{([^}]*)\}", style) for name in re.findall(r"--([\w-]+):", part)}
        for selector in (":root", r':root\[data-theme="dark"\]')
    )
    assert light == dark
    used = {*re.findall(r"var\(--([a-z][\w-]*)\)", page + scripts), *re.findall(r'colour\("([\w-]+)"\)', scripts)}
    assert used - set(re.findall(r'--([a-z]+)(?:: |",)', scripts)) <= light  # but for those that scripts set
    listed = re.search(r"const names = \[(.*?)\]", file_text("draw/colours.js"), re.DOTALL)
    assert listed is not None
    assert set(re.findall(r'"(\w+)"', listed[1])) <= light


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_text_can_be_read_on_whatever_it_stands_on(dark: bool) -> None:
    selector = r':root\[data-theme="dark"\]' if dark else ":root"
    parts = re.findall(selector + r" \{([^}]*)\}", page_style())
    of = dict(re.findall(r"--([\w-]+): (#\w{6})", " ".join(parts)))
    for ground in ("card", "back"):
        assert min(contrast(of["ink"], of[ground]), contrast(of["dim"], of[ground])) >= 4.5
    assert contrast(of["on-accent"], of["accent"]) >= 4.5
    assert min(contrast("#ffffff", of[badge]) for badge in ("good", "warn", "bad")) >= 4.5
    assert contrast("#ffffff", "#57606c") >= 4.5  # the badge of a mission under way
    assert min(contrast("#0b0d10", of[bar]) for bar in ("drive", "explore")) >= 4.5  # names in the lanes


@pytest.mark.parametrize("field", ["scenario", "strategy", "planner"])
def test_no_text_in_the_log_can_become_markup(field: str) -> None:
    events = (replace(mission_started(), **{field: NASTY}), *EVENTS[1:])
    page = replay_page(events)
    assert logged(page) == [events]
    assert Outline(page).all("script") == Outline(replay_page(EVENTS)).all("script")


def test_the_title_is_escaped() -> None:
    page = replay_page([replace(mission_started(), scenario=NASTY)])
    assert "<title>&lt;/script&gt;&lt;script&gt;" in page


def test_a_reason_in_the_log_can_hold_anything() -> None:
    plan = next(event for event in EVENTS if isinstance(event, Planned))
    events = (mission_started(), replace(plan, trigger=read_triggers(NASTY)))
    assert logged(replay_page(events)) == [events]


def test_a_log_without_an_end_makes_a_page() -> None:
    assert logged(replay_page(EVENTS[:7])) == [EVENTS[:7]]


def test_the_same_events_make_the_same_page(page: str) -> None:
    assert replay_page(list(EVENTS)) == page
