"""A mission, or some side by side, as one HTML page that needs no network, server or library.

::

    page.html ◄─┬─ <style>    palette as CSS variables + page.css
                ├─ <script type="application/gzip" class="modules">    modules by name, as JSON: gzip, base 64
                ├─ <script type="application/gzip" class="log">    one log: gzip, base 64
                └─ <script>   file.js: unpacks modules and logs, and shows them

The page itself computes what follows from a log (`log/model.js`), such as robots' places and carriers, and can save the
log again. Base 64 has no character that could end an element or be taken for markup, so modules and logs may hold any
text. The service serves the same modules as files.
"""

import gzip
import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping
from dataclasses import fields
from html import escape
from importlib.resources import files

from marsupial.formats.loglines import log_lines
from marsupial.model.mission import MissionEvent, MissionStarted
from marsupial.replay.palette import DARK, LIGHT, Palette

LAYERS = ("log", "text", "draw", "page")
"""Folders of the page's modules; a module imports from its own and those before it (eslint.config.js)."""

LIVE = "live"
"""The folder of modules of the service's page alone; its modules import from all others."""

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' data:; img-src data: blob:"
_SLOT = re.compile(r"\{\{(\w+)\}\}")
_PACKING = 9


def replay_page(*missions: Iterable[MissionEvent]) -> str:
    """Return the page that replays a mission from all its events, or up to six missions side by side.

    The page's address takes options: ``#t=120`` opens it at 120 s; ``play=1``, ``speed=10``, ``theme=dark`` and the
    layers ``labels``, ``sensors``, ``plan``, ``guess`` and ``trails`` as 0 or 1 may follow, joined by ``&``.
    """
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    titles, logs = [], []
    for one in map(tuple, missions):
        first, lines = one[0], "".join(f"{line}\n" for line in log_lines(one))
        assert isinstance(first, MissionStarted)
        titles.append(f"{first.scenario}: {first.strategy}, seed {first.seed}")
        logs.append(_packed("log", lines))
    modules = _packed("modules", json.dumps({f"#{name}": text for name, text in module_texts(*LAYERS).items()}))
    return page_shell(
        title=" and ".join(dict.fromkeys(titles)),
        head=f"{policy}\n<style>\n{page_style()}\n</style>",
        scripts="\n".join((modules, *logs, f"<script>\n{file_text('file.js')}</script>")),
    )


def _packed(kind: str, text: str) -> str:
    """Return an element that holds a text. Browsers can unpack gzip; the same text is the same element."""
    data = b64encode(gzip.compress(text.encode("ascii"), _PACKING, mtime=0)).decode("ascii")
    return f'<script type="application/gzip" class="{kind}">\n{data}\n</script>'


def page_shell(*, title: str, head: str, scripts: str) -> str:
    """Return ``page.html`` with its slots filled; `title` is text, the others are markup."""
    parts = {"title": escape(title), "head": head, "scripts": scripts}
    return _SLOT.sub(lambda slot: parts[slot[1]], file_text("page.html"))


def page_style() -> str:
    """Return the style of the page: the palettes, light and dark, then ``page.css``."""
    dark = ':root[data-theme="dark"]'
    return f":root {{ {_variables(LIGHT)} }}\n{dark} {{ {_variables(DARK)} }}\n{file_text('page.css').strip()}"


def module_texts(*folders: str) -> Mapping[str, str]:
    """Return the page's modules in these folders by name, such as ``log/model.js``."""
    there = {folder: files("marsupial.replay").joinpath(folder) for folder in folders}
    return {
        f"{folder}/{entry.name}": entry.read_text(encoding="utf-8")
        for folder, entries in there.items()
        for entry in sorted(entries.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".js")
    }


def file_text(name: str) -> str:
    """Return the text of a file of the page: a module, the style, the shell."""
    return files("marsupial.replay").joinpath(name).read_text(encoding="utf-8")


def _variables(palette: Palette) -> str:
    """Return the palette as CSS variables: ``--family-0-1`` for the first rover of the first carrier."""
    families = {
        f"family-{i}-{k}": colour for i, family in enumerate(palette.families) for k, colour in enumerate(family)
    }
    plain = {f.name: value for f in fields(palette) if isinstance(value := getattr(palette, f.name), str)}
    return " ".join(f"--{name}: {colour};" for name, colour in {**families, **plain, **palette.actions}.items())
