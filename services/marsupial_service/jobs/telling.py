"""What is told of jobs as it was sent or found; in a process of its own where that is much."""

from __future__ import annotations

import json
from collections.abc import Iterator

from marsupial_service.jobs.documents import line


def situation_text(source: str) -> bytes | None:
    """Return the situation in what was sent for a job, as JSON; None if that was a map state."""
    sent = json.loads(source)
    return line({"situation": sent["situation"], "places": None}).encode() if "situation" in sent else None


def tell_situation(source: str) -> Iterator[bytes | None]:
    """Yield the situation in what was sent for a job; the function of a job."""
    yield situation_text(source)
