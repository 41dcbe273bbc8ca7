"""A mission as one HTML page that needs nothing else: no network, no server, no library.

The page is put together from ``replay.html``, its style and its scripts, and holds the mission log itself, line by
line, in a script element: the browser plays it from there, and it can be saved again from the page. Whatever stands
in the log, it can neither end that element nor be taken for markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from importlib.resources import files

from marsupial.formats.missionlog import encode_event
from marsupial.model.mission import MissionEvent, MissionStarted

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
        "script": "\n".join(["(() => {", '"use strict";', *map(_read, _SCRIPTS), "})();"]),
        "log": "\n".join(_embedded(event) for event in events),
    }
    template = _text("page.html")
    return _SLOT.sub(lambda slot: parts[slot[1]], template)


def _read(name: str) -> str:
    return _text(name).strip()


def _text(name: str) -> str:
    return files("marsupial.replay").joinpath(name).read_text(encoding="utf-8")


def _embedded(event: MissionEvent) -> str:
    """Return the event's line with `<` written as JSON can write it too: no text in it can then close the element."""
    return encode_event(event).replace("<", "\\u003c")
