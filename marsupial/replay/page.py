"""A mission, or some side by side, as one HTML page that needs no network, server or library.

::

    page.html ◄─┬─ <style>    palette as CSS variables + page.css
                ├─ <script type="application/gzip" class="log">    one log: gzip, base 64
                └─ <script>   modules (*.js) in one scope, without imports, exports and comments

The page itself computes what follows from a log (`model.js`), such as robots' places and carriers, and can save the log
again. Base 64 has no character that could end an element or be taken for markup, so a log may hold any text. The
service serves the same modules as files, without joining them.
"""

import gzip
import re
from base64 import b64encode
from collections.abc import Iterable
from dataclasses import fields
from html import escape
from importlib.resources import files

from marsupial.formats.loglines import log_lines
from marsupial.model.mission import MissionEvent, MissionStarted
from marsupial.replay.palette import DARK, LIGHT, Palette

MODULES = (
    *("format", "history", "strips", "legs", "places", "knownmap", "ahead", "model", "ground"),
    *("dom", "colours", "shapes", "zones", "why", "routes", "labels", "frontier", "camera", "planlayer", "map"),
    *(
        "happening",
        "pointer",
        "panels",
        "pane",
        "planlanes",
        "lanes",
        "legend",
        "difference",
        "telling",
        "tip",
        "keys",
        "transport",
        "app",
        "saving",
    ),
)
"""The page's modules, ``NAME.js``, each after those that it imports."""

LIVE_MODULES = (
    *("service", "stream", "picture", "preview", "startform", "entrylist", "zoneform", "missionspage"),
    *("jobdrawing", "jobpage", "live"),
)
"""Modules of the service's page alone."""

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
_SLOT = re.compile(r"\{\{(\w+)\}\}")
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=class |const |function |async function )", re.MULTILINE)
_COMMENT = re.compile(r"^ *(/\*.*?\*/)\n+", re.MULTILINE | re.DOTALL)
_PACKING = 9


def replay_page(*missions: Iterable[MissionEvent]) -> str:
    """Return the page that replays a mission from all its events, or up to six missions side by side.

    The page's address takes options: ``#t=120`` opens it at 120 s; ``play=1``, ``speed=10``, ``theme=dark`` and the
    layers ``labels``, ``sensors``, ``plan`` and ``trails`` as 0 or 1 may follow, joined by ``&``.
    """
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    titles, logs = [], []
    for one in map(tuple, missions):
        first, lines = one[0], "".join(f"{line}\n" for line in log_lines(one))
        assert isinstance(first, MissionStarted)
        titles.append(f"{first.scenario}: {first.strategy}, seed {first.seed}")
        # Browsers can unpack gzip; without a time in it, the same mission is the same page.
        packed = b64encode(gzip.compress(lines.encode("ascii"), _PACKING, mtime=0)).decode("ascii")
        logs.append(f'<script type="application/gzip" class="log">\n{packed}\n</script>')
    return page_shell(
        title=" and ".join(dict.fromkeys(titles)),
        head=f"{policy}\n<style>\n{page_style()}\n</style>",
        scripts="\n".join((*logs, f"<script>\n{joined_modules()}\n</script>")),
    )


def page_shell(*, title: str, head: str, scripts: str) -> str:
    """Return ``page.html`` with its slots filled; `title` is text, the others are markup."""
    parts = {"title": escape(title), "head": head, "scripts": scripts}
    return _SLOT.sub(lambda slot: parts[slot[1]], module_text("page.html"))


def page_style() -> str:
    """Return the style of the page: the palettes, light and dark, then ``page.css``."""
    dark = ':root[data-theme="dark"]'
    return f":root {{ {_variables(LIGHT)} }}\n{dark} {{ {_variables(DARK)} }}\n{module_text('page.css').strip()}"


def joined_modules() -> str:
    """Return the page's modules as one script; no two of them define the same name, so that they can share a scope."""
    names = (*MODULES, "file")
    texts = (_EXPORT.sub("", _IMPORT.sub("", script_text(name))).strip() for name in names)
    return "\n".join(["(() => {", '"use strict";', *texts, "})();"])


def script_text(name: str) -> str:
    """Return a module without its comments, which nobody needs to download."""
    return _COMMENT.sub("", module_text(f"{name}.js"))


def module_text(name: str) -> str:
    """Return the text of a file of the page: a module, the style, the shell."""
    return files("marsupial.replay").joinpath(name).read_text(encoding="utf-8")


def _variables(palette: Palette) -> str:
    """Return the palette as CSS variables: ``--family-0-1`` for the first rover of the first carrier."""
    families = {
        f"family-{i}-{k}": colour for i, family in enumerate(palette.families) for k, colour in enumerate(family)
    }
    plain = {f.name: value for f in fields(palette) if isinstance(value := getattr(palette, f.name), str)}
    return " ".join(f"--{name}: {colour};" for name, colour in {**families, **plain, **palette.actions}.items())
