"""A mission as one HTML page that needs nothing else: no network, no server, no library.

The page is put together from ``page.html``, its style and its modules, and holds the mission log itself in a script
element: the browser plays it from there, and it can be saved again from the page. All that follows from the log, such as
who is where and on whom, the page works out itself (`model.js`). Whatever stands in the log, it can neither end an
element nor be taken for markup.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from html import escape
from importlib.resources import files

from marsupial.formats.loglines import log_lines
from marsupial.model.mission import MissionEvent, MissionStarted

MODULES = ("history", "strips", "legs", "places", "knownmap", "model", "ground", "map", "lanes", "app")
"""The page's modules, ``NAME.js``, each after those that it imports."""

_SLOT = re.compile(r"\{\{(\w+)\}\}")
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=class |const |function |async function )", re.MULTILINE)


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
        "style": module_text("page.css").strip(),
        "script": joined_modules(),
        "log": "\n".join(map(_embedded, log_lines(events))),
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], module_text("page.html"))


def joined_modules() -> str:
    """Return the page's modules as one script: they say nothing twice, so that they can share one scope."""
    texts = (_EXPORT.sub("", _IMPORT.sub("", module_text(f"{name}.js"))).strip() for name in MODULES)
    return "\n".join(["(() => {", '"use strict";', *texts, "})();"])


def module_text(name: str) -> str:
    """Return the text of a file of the page: a module, the style, the shell."""
    return files("marsupial.replay").joinpath(name).read_text(encoding="utf-8")


def _embedded(text: str) -> str:
    """Return JSON with `<` written as it can write it too: no text in it can then close the element."""
    return text.replace("<", "\\u003c")
