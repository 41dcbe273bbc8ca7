"""A reported map: the log has what is reported, cells once, and truly where nothing distorts them."""

from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import Account
from benchmarks.storm.ground import UNKNOWN, Document


def what_is_reported_is_known(account: Account, event: Document) -> Iterator[str]:
    """Check each change of the known map."""
    if event["event"] not in ("reveal", "change") or account.reported is None:
        return
    distortion = account.reported.distortion
    untrue = distortion.shifts > 0 or "ground" in account.faults.what
    for name, _, seen in event["looks"]:
        for (x, y), code in seen:
            if not account.holds((x, y)):
                yield f"{name} sees {(x, y)}, which is not in the frame"
                return
            before = account.known[y, x]
            if (before == UNKNOWN) != (event["event"] == "reveal") or before == code:
                yield f"{name} sees {code} at {(x, y)}, which was {before}"
            if code != UNKNOWN and distortion.hidden[y, x]:
                yield f"{name} sees {(x, y)}, which is never reported"
            may_be_wrong = untrue or (distortion.wrong and distortion.flickers[y, x])
            if code not in (UNKNOWN, account.drawn[y, x]) and not may_be_wrong:
                yield f"{name} sees {code} at {(x, y)}, where {account.drawn[y, x]} is"


def last_map_is_known(account: Account, event: Document) -> Iterator[str]:
    """Check at the end that the known map is the last that was reported."""
    if event["event"] != "ended" or account.reported is None:
        return
    last = account.reported.last
    if any(last.shift) or not last.cells.size:
        return
    (x, y), (height, width) = last.corner, last.cells.shape
    expected = np.full_like(account.known, UNKNOWN)
    expected[y : y + height, x : x + width] = last.cells
    for v, u in np.argwhere(expected != account.known)[:1].tolist():
        yield f"the map has {account.known[v, u]} at {(u, v)}, but {expected[v, u]} was reported"
