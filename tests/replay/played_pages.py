"""Replay pages of a synthetic mission in a browser."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from support.missions.synthetic_mission import mission_started, synthetic_mission
from support.pictures.browser import DESK, Browser, View

from marsupial.model import Action, MissionEvent, Planned
from marsupial.replay.page import replay_page

EVENTS = synthetic_mission()
OTHER = (replace(mission_started(), strategy="heuristic"), *EVENTS[1:])

OVER = """
const canvas = document.querySelector(arguments[0]), tip = document.querySelector(".tip");
const box = canvas.getBoundingClientRect();
for (let y = 4; y < box.height; y += 6) for (let x = 4; x < box.width; x += 6) {
  const at = { clientX: box.left + x, clientY: box.top + y, bubbles: true, pointerType: "mouse" };
  canvas.dispatchEvent(new PointerEvent("pointermove", at));
  if (!tip.hidden && tip.innerText.startsWith(arguments[1])) return [tip.innerText, Math.round(x), Math.round(y)];
}
return null;
"""
"""Move the pointer over a canvas until the tooltip begins with a text; return the tooltip and the position."""


PRESS = """
const canvas = document.querySelector(arguments[0]), box = canvas.getBoundingClientRect();
const at = { clientX: box.left + arguments[1], clientY: box.top + arguments[2], bubbles: true, pointerId: 1 };
for (const kind of ["pointerdown", "pointerup"]) canvas.dispatchEvent(new PointerEvent(kind, at));
"""
"""Click on a canvas, at a place in its own points."""


WHERE = """
const canvas = document.querySelector("canvas.map"), where = document.querySelector(".where");
const box = canvas.getBoundingClientRect();
for (let y = 4; y < box.height; y += 6) for (let x = 4; x < box.width; x += 6) {
  const at = { clientX: box.left + x, clientY: box.top + y, bubbles: true, pointerType: "mouse" };
  canvas.dispatchEvent(new PointerEvent("pointermove", at));
  if (where.textContent.includes(arguments[0])) return where.textContent;
}
return null;
"""
"""Move the pointer over the map until the text about its place contains another one; return it."""


class PlayedPage(Browser):
    """A tab for replay pages, which load before their modules are unpacked and draw the map."""

    def open(self, url: str, view: View = DESK, *, dark: bool = False) -> None:
        super().open(url, view, dark=dark)
        self.find("canvas.map")


def written(folder: Path, *missions: Sequence[MissionEvent]) -> str:
    file = folder / "replay.html"
    file.write_text(replay_page(*missions), encoding="utf-8")
    return file.as_uri()


def hover(browser: Browser, canvas: str, begin: str) -> tuple[str, int, int]:
    found = browser.run(OVER, canvas, begin)
    assert found, f"nothing on {canvas} is told as {begin!r}"
    return found[0], found[1], found[2]


def drawn(browser: Browser) -> None:
    """Wait for the next frame."""
    browser.run(
        "window.drawn = false; requestAnimationFrame(() => requestAnimationFrame(() => { window.drawn = true; }));"
    )
    browser.wait("window.drawn")


def planned_later(mission: Sequence[MissionEvent], *more: Action) -> tuple[MissionEvent, ...]:
    """Return a mission with more actions in its first plan."""
    return tuple(
        replace(event, actions=(*event.actions, *more)) if isinstance(event, Planned) and event.revision == 1 else event
        for event in mission
    )


AT = "document.querySelectorAll('.pane')[arguments[0]].querySelector('.where').textContent.split(' · ')[0]"


def place_under(browser: Browser, pane: int) -> str:
    """Return the place in metres at one point of the map of a pane."""
    point = (
        "const canvas = document.querySelectorAll('canvas.map')[arguments[0]], box = canvas.getBoundingClientRect();"
        "const at = { clientX: box.left + 100, clientY: box.top + 150, bubbles: true, pointerType: 'mouse' };"
        f"canvas.dispatchEvent(new PointerEvent('pointermove', at)); return {AT};"
    )
    return str(browser.run(point, pane))
