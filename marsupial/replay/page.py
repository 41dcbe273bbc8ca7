"""A mission as one HTML page that needs nothing else: no network, no server, no library.

The page is put together from ``replay.html``, its style and its scripts, and holds the mission log itself, line by
line, in a script element: the browser plays it from there, and it can be saved again from the page. Beside it stands
what follows from the log about who is where, on whom (`model.js` says how). Whatever stands in the log, it can neither
end an element nor be taken for markup.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from marsupial.formats.loglines import log_lines
from marsupial.mission.playback import Playback
from marsupial.mission.state import Tracks
from marsupial.model.mission import ActionStarted, MissionEvent, MissionStarted

_SCRIPTS = ("model.js", "map.js", "lanes.js", "app.js")
_SLOT = re.compile(r"\{\{(\w+)\}\}")


def replay_page(events: Iterable[MissionEvent]) -> str:
    """Return the page that replays `events`, the events of one mission from its start.

    ``#t=120`` behind the page's address opens it at 120 s; ``play=1``, ``speed=10``, ``theme=dark`` and the layers
    ``labels``, ``sensors``, ``plan``, ``trails`` and ``legend`` as 0 or 1 may follow, joined by ``&``.
    """
    events = tuple(events)
    first = events[0]
    assert isinstance(first, MissionStarted)
    parts = {
        "title": escape(f"{first.scenario}: {first.strategy}, seed {first.seed}"),
        "style": _read("page.css"),
        "script": "\n".join(["(() => {", '"use strict";', _team(events), *map(_read, _SCRIPTS), "})();"]),
        "log": "\n".join(map(_embedded, log_lines(events))),
    }
    template = _text("page.html")
    return _SLOT.sub(lambda slot: parts[slot[1]], template)


def _read(name: str) -> str:
    return _text(name).strip()


def _text(name: str) -> str:
    return files("marsupial.replay").joinpath(name).read_text(encoding="utf-8")


def _team(events: Sequence[MissionEvent]) -> str:
    """Return the script that tells where each robot is, on whom, and what it does, from when on."""
    playback = Playback(events)
    starts = {
        (e.t_ms, id(e.action)): number for number, e in enumerate(playback.events) if isinstance(e, ActionStarted)
    }
    team = {
        name: {
            "legs": legs,
            "actions": [(starts[s.start_ms, id(s.action)], s.end_ms, s.end) for s in playback.timeline[name]],
        }
        for name, legs in _legs(playback).items()
    }
    return _embedded(f"const TEAM = {json.dumps(team, separators=(',', ':'))};")


def _legs(playback: Playback) -> dict[str, list[tuple[int, str | int]]]:
    """Return since when each robot is aboard which carrier, or where the event with that number puts it."""
    legs: dict[str, list[tuple[int, str | int]]] = {robot.name: [] for robot in playback.mission.robots}
    before: Tracks = {}
    for number, tracks in playback.moments:
        for name, track in tracks.items():
            was, where = before[name].where if before else None, track.where
            if was is None or was.at is not where.at or was.aboard != where.aboard:
                legs[name].append((playback.events[number].t_ms, where.aboard or number))
        before = tracks
    return legs


def _embedded(text: str) -> str:
    """Return JSON with `<` written as it can write it too: no text in it can then close the element."""
    return text.replace("<", "\\u003c")
