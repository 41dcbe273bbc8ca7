"""The page at ``/``: the parts of a replay page as separate files, with live data from the service.

The page loads nothing from other hosts and has no inline script or style: a strict policy allows only files that this
service serves. Browsers cache the files, and revalidate them each time.
"""

import hashlib
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

from fastapi import APIRouter, Request, Response

from marsupial.replay.page import LIVE_MODULES, MODULES, module_text, page_shell, page_style, script_text
from marsupial_service.problems import HttpProblem

_STYLES = ("page.css", "live.css")
_HEAD = "\n".join(f'<link rel="stylesheet" href="page/{name}">' for name in _STYLES)
_SCRIPT = '<script type="module" src="page/live.js"></script>'

_HEADERS: Mapping[str, str] = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}

router = APIRouter(include_in_schema=False)


class PageFile(NamedTuple):
    """A file of the page as it is sent; `tag` tells it from any other."""

    data: bytes
    media_type: str
    tag: str


@cache
def page_files() -> Mapping[str, PageFile]:
    """Return the page itself (the empty name) and the files that it loads, by name."""
    scripts = {f"{name}.js": _file(script_text(name), "javascript") for name in (*MODULES, *LIVE_MODULES)}
    styles = {"page.css": _file(page_style(), "css"), "live.css": _file(module_text("live.css"), "css")}
    return {"": _file(page_shell(title="marsupial", head=_HEAD, scripts=_SCRIPT), "html"), **scripts, **styles}


def _file(text: str, kind: str) -> PageFile:
    data = text.encode()
    return PageFile(data, f"text/{kind}; charset=utf-8", f'"{hashlib.sha256(data).hexdigest()[:32]}"')


@router.get("/")
async def get_page(request: Request) -> Response:
    return _sent(request, page_files()[""])


@router.get("/page/{name}")
async def get_page_file(request: Request, name: str) -> Response:
    """Return one of the files that the page loads."""
    file = page_files().get(name)
    if file is None:
        raise HttpProblem("not-found", "the page has no such file")
    return _sent(request, file)


def _sent(request: Request, file: PageFile) -> Response:
    headers = {**_HEADERS, "ETag": file.tag}
    if file.tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(file.data, headers=headers, media_type=file.media_type)
