from collections.abc import Iterator

import pytest

from marsupial_service.entries.records import KeyReused, NewEntry
from marsupial_service.jobs.lookup import JOBS
from marsupial_service.store import Store, Transaction, open_store

NEW = (
    "INSERT INTO jobs (id, owner, idempotency_key, digest, planner, state, created_ms, queued_ms, finished_ms)"
    " VALUES (?, 'me', ?, ?, '', '', 0, 0, ?)"
)


@pytest.fixture
def store(place: str) -> Iterator[Store]:
    opened = open_store(place)

    def fill(tx: Transaction) -> None:
        for name, key, finished_ms in (("a", "k", 100), ("b", None, 200), ("c", None, 300), ("open", None, None)):
            tx.execute(NEW, (name, key, name.encode(), finished_ms))

    opened.write(fill).result()
    yield opened
    opened.close()


def test_a_repeated_idempotency_key_returns_its_owner_s_entry(store: Store) -> None:
    def look(owner: str, key: str | None, digest: bytes) -> str | None:
        return store.write(
            lambda tx: JOBS.find_replayed(tx, NewEntry(id="", owner=owner, key=key, digest=digest))
        ).result()

    assert look("me", "k", b"a") == "a"
    assert look("you", "k", b"a") is None
    assert look("me", "other", b"a") is None
    assert look("me", None, b"b") is None
    with pytest.raises(KeyReused):
        look("me", "k", b"b")


@pytest.mark.parametrize(
    ("before_ms", "kept", "most", "left"),
    [
        (0, 9, 9, ["a", "b", "c", "open"]),
        (200, 9, 9, ["b", "c", "open"]),
        (0, 1, 9, ["c", "open"]),
        (0, 0, 2, ["c", "open"]),
        (999, 0, 9, ["open"]),
    ],
)
def test_old_and_surplus_entries_are_removed_and_open_ones_stay(
    store: Store, before_ms: int, kept: int, most: int, left: list[str]
) -> None:
    told: list[frozenset[str]] = []
    store.listen(lambda topics: told.append(topics or frozenset()))
    removed = store.write(lambda tx: JOBS.remove_old(tx, 0, kept, before_ms, most)).result()
    found = store.read(lambda c: [row[0] for row in c.execute("SELECT id FROM jobs ORDER BY id")]).result()
    assert (removed, len(found), found[-1]) == (4 - len(left), len(left), "open")
    assert most < 3 or found == left
    assert frozenset().union(*told).isdisjoint(found)
    assert len(frozenset().union(*told)) == removed
