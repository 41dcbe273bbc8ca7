"""The page at ``/``: the parts of a replay page as separate files, with live data from the service.

The page loads nothing from other hosts and has no inline script or style, but for the map from the names by which
modules import each other to their addresses: a strict policy allows it by its hash, and only files that this service
serves. Browsers cache the files, and revalidate them each time.
"""

import gzip
import hashlib
import json
from base64 import b64encode
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from fastapi import APIRouter, Request, Response

from marsupial.replay.page import LAYERS, LIVE, file_text, module_texts, page_shell, page_style
from marsupial_service.problems import HttpProblem

_STYLES = ("page.css", "live.css")
_HEAD = "\n".join(f'<link rel="stylesheet" href="page/{name}">' for name in _STYLES)
_FOLDERS = (*LAYERS, LIVE)
_IMPORTS = json.dumps({"imports": {f"#{folder}/": f"./page/{folder}/" for folder in _FOLDERS}})
_IMPORTS_HASH = b64encode(hashlib.sha256(_IMPORTS.encode()).digest()).decode()
_SCRIPTS = f"""<script type="importmap">{_IMPORTS}</script>
<script type="module" src="page/live/live.js"></script>"""

_HEADERS: Mapping[str, str] = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": f"default-src 'none'; script-src 'self' 'sha256-{_IMPORTS_HASH}'; style-src 'self'; "
    "connect-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}

router = APIRouter(include_in_schema=False)


class PageFile(NamedTuple):
    """A file of the page, packed by gzip; `tag` tells its content from any other."""

    packed: bytes
    media_type: str
    tag: str


@cache
def page_files() -> Mapping[str, PageFile]:
    """Return the page itself (the empty name) and the files that it loads, by name."""
    scripts = {name: _file(text, "javascript") for name, text in module_texts(*_FOLDERS).items()}
    styles = {"page.css": _file(page_style(), "css"), "live.css": _file(file_text("live.css"), "css")}
    return {"": _file(page_shell(title="marsupial", head=_HEAD, scripts=_SCRIPTS), "html"), **scripts, **styles}


def _file(text: str, kind: str) -> PageFile:
    data = text.encode()
    return PageFile(gzip.compress(data), f"text/{kind}; charset=utf-8", f'W/"{hashlib.sha256(data).hexdigest()[:32]}"')


@router.get("/")
async def get_page(request: Request) -> Response:
    return _sent(request, page_files()[""])


@router.get("/page/{name:path}")
async def get_page_file(request: Request, name: str) -> Response:
    """Return one of the files that the page loads."""
    file = page_files().get(name)
    if file is None:
        raise HttpProblem("not-found", "the page has no such file")
    return _sent(request, file)


def _sent(request: Request, file: PageFile) -> Response:
    headers = {**_HEADERS, "ETag": file.tag, "Vary": "Accept-Encoding"}
    if file.tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return Response(gzip.decompress(file.packed), headers=headers, media_type=file.media_type)
    return Response(file.packed, headers={**headers, "Content-Encoding": "gzip"}, media_type=file.media_type)
