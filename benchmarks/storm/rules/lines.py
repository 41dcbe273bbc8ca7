"""The lines of a log: time never goes back, and the first line describes the scenario."""

from collections.abc import Iterator

from benchmarks.storm.account import Account
from benchmarks.storm.ground import Document


def lines_are_in_order(account: Account, event: Document) -> Iterator[str]:
    """Check time, and the seats and the map of the first line."""
    if event["t_ms"] < account.t_ms:
        yield "time goes back"
    if event is not account.first:
        return
    seats = {kind["name"]: kind.get("seats", {}) for kind in account.scenario["robot_types"]}
    for kind in account.kinds.values():
        if dict(kind.get("seats", ())) != seats[kind["name"]]:
            yield f"the seats of {kind['name']} are {kind.get('seats')}"
    if account.reported is None and account.size[::-1] != account.truth.shape:
        yield "the size of the map is another"
