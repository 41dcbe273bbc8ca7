"""Jobs as they are stored."""

from __future__ import annotations

import json
import zlib

from marsupial_service.jobs.records import JobRequest, PackedRequest
from marsupial_service.store import kept


def pack(request: JobRequest) -> PackedRequest:
    """Return a job as it is stored."""
    return PackedRequest(
        planner=request.planner,
        budget=request.budget,
        digest=request.digest,
        task=kept.dumps(request.task),
        source=zlib.compress(json.dumps(request.source).encode(), 1),
    )
