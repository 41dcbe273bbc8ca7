"""JSON pointers (RFC 6901) to what is wrong in a body.

The library names a field by a path (``robots[1].type``), where a key may be any text, pydantic by a tuple that may hold
words that are not in the body. Both are walked through the body itself.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from marsupial_service.schemas.base import VARIANT

_INDEX = re.compile(r"\[(\d+)\]")


def pointer(parts: Sequence[str | int]) -> str:
    """Return the pointer to the value that the keys and indices lead to; empty for the whole body."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def of_path(path: str, body: object) -> str:
    """Return the pointer for a path of the library into `body`; what is not there counts as a missing field."""
    parts: list[str | int] = []
    while path:
        part, path = _first(path.removeprefix("."), body)
        parts.append(part)
        body = _at(body, part)
    return pointer(parts)


def of_location(location: Sequence[str | int], body: object) -> str:
    """Return the pointer for a location of pydantic's, without the words by which it tells variants apart."""
    parts: list[str | int] = []
    location = [part for part in location if not str(part).startswith(VARIANT)]
    for i, part in enumerate(location):
        found = _at(body, part)
        is_missing = i == len(location) - 1 and isinstance(body, Mapping) and isinstance(part, str)
        if found is not None or is_missing:
            parts.append(part)
            body = found
    return pointer(parts)


def _first(path: str, body: object) -> tuple[str | int, str]:
    """Split off the first step of a path: the longest key of the body it begins with."""
    index = _INDEX.match(path)
    if index is not None:
        return int(index[1]), path[index.end() :]
    if isinstance(body, Mapping):
        keys = [key for key in body if isinstance(key, str) and key and _begins(path, key)]
        if keys:
            key = max(keys, key=len)
            return key, path[len(key) :]
    match = re.match(r"[^.\[]*", path)
    word = match[0] if match is not None and match[0] else path
    return word, path[len(word) :]


def _begins(path: str, key: str) -> bool:
    return path.startswith(key) and path[len(key) : len(key) + 1] in ("", ".", "[")


def _at(body: object, part: str | int) -> Any:
    if isinstance(body, Mapping):
        return body.get(part)
    if isinstance(body, list) and isinstance(part, int) and part < len(body):
        return body[part]
    return None
