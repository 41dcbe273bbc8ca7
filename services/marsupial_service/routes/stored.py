"""What the routes of jobs and missions answer alike: that an entry is stored, and the pages of a list."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from urllib.parse import urlencode

from marsupial_service.entries.records import Created, E
from marsupial_service.http.openapi import errors
from marsupial_service.schemas.base import Answer


def stored(model: type[Answer], noun: str, status: int, at_once: str) -> dict[int | str, dict[str, Any]]:
    """Return the responses of a route that stores an entry; it may answer 200 instead, `at_once`."""
    answer = {"model": model, "headers": {"Location": {"schema": {"type": "string"}}}}
    return {
        **errors("key-reused", "too-many", "not-ready", "store-full", body=True),
        200: {**answer, "description": at_once},
        status: {**answer, "description": f"The {noun} is stored; it is at Location."},
    }


def headers_of(created: Created[E], path: str) -> dict[str, str]:
    """Return the headers that tell where an entry is, and whether an earlier request had made it."""
    return {"Location": path} | ({"Idempotency-Replayed": "true"} if created.replayed else {})


def page(found: Sequence[E], limit: int, path: str, **query: str | None) -> tuple[Sequence[E], str | None]:
    """Return the page of a list, and where the next one is; `found` has one entry more if there is one."""
    if len(found) <= limit:
        return found, None
    words = {"limit": limit, **query, "before": found[limit - 1].id}
    return found[:limit], f"{path}?{urlencode({name: word for name, word in words.items() if word is not None})}"
