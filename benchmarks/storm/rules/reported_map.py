"""A reported map: at the end of the log the known map is the one that was reported last."""

from collections.abc import Iterator

import numpy as np

from benchmarks.storm.account import Account
from benchmarks.storm.ground import UNKNOWN, Document


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
