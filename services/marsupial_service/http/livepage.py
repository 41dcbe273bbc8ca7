"""The page at ``/``: what replay pages are made of, as files of their own, fed by the service as it goes on.

Nothing is loaded from elsewhere, and no script or style stands in the page itself: a strict policy allows only what is
served beside it. Browsers keep the files, and ask each time whether they are still the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from fastapi import APIRouter, Request, Response

from marsupial_service.http.problems import HttpProblem

SHELL = "live.html"

_MEDIA_TYPES: Mapping[str, str] = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
}

_HEADERS: Mapping[str, str] = {
    "Cache-Control": "no-cache",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
}

router = APIRouter(include_in_schema=False)


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file of the page as it is sent; `tag` tells it from any other."""

    data: bytes
    media_type: str
    tag: str


@cache
def page_files() -> Mapping[str, PageFile]:
    """Return all files of the page, by name."""
    found = {}
    for entry in files("marsupial.replay").iterdir():
        media_type = _MEDIA_TYPES.get(entry.name[entry.name.rfind(".") :])
        if media_type is not None:
            data = entry.read_bytes()
            tag = f'"{hashlib.sha256(data).hexdigest()[:32]}"'
            found[entry.name] = PageFile(data, media_type, tag)
    return found


@router.get("/")
async def get_page(request: Request) -> Response:
    """Return the page."""
    return _sent(request, page_files()[SHELL])


@router.get("/page/{name}")
async def get_page_file(request: Request, name: str) -> Response:
    """Return one of the files that the page loads."""
    file = page_files().get(name)
    if file is None or name.endswith(".html"):
        raise HttpProblem("not-found", "the page has no such file")
    return _sent(request, file)


def _sent(request: Request, file: PageFile) -> Response:
    headers = {**_HEADERS, "ETag": file.tag}
    if file.tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(file.data, headers=headers, media_type=file.media_type)
