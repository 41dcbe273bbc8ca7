"""API keys, with their scopes and expiry. Only their hashes are stored, in one document that servers reread.

A key is shown once, when it is created. The document is a file in the data folder, or a row of a database that servers
share; it is replaced atomically, so that a reader sees all of a change or nothing.
"""

import fcntl
import hashlib
import hmac
import json
import secrets
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path

from marsupial.errors import UsageError
from marsupial_service.store import Store, Transaction, documents, open_store
from marsupial_service.store.sqlite import private_draft
from marsupial_service.store.transaction import StoreReader

FILE = "keys.json"
# the topic of changes to the keys of a shared database
TOPIC = "keys"
# how many valid keys a name may have: the current one, and the one that its clients will use next
MOST_OF_A_NAME = 2

_PREFIX = "msp_"
_ROW = "keys"


class Scope(StrEnum):
    """What a key allows."""

    PLAN = "plan"
    MISSION = "mission"
    ADMIN = "admin"


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A stored key; `name` identifies the owner of jobs. Times are in seconds since 1970."""

    name: str
    sha256: str
    scopes: tuple[str, ...]
    created_s: float
    expires_s: float
    revoked_s: float | None = None

    @property
    def id(self) -> str:
        """The id by which an operator tells apart the keys of one name."""
        return self.sha256[:8]

    def is_valid(self, now_s: float) -> bool:
        return self.revoked_s is None and now_s < self.expires_s


class Keys(ABC):
    """The keys of one service."""

    @abstractmethod
    def all(self) -> tuple[Key, ...]:
        """Return all keys, including expired and revoked ones."""

    @abstractmethod
    def _change(self, change: Callable[[tuple[Key, ...]], tuple[Key, ...]]) -> None:
        """Replace the keys by the result of `change`, unless that raises."""

    def find(self, secret: str, now_s: float) -> Key | None:
        """Return the key with that secret if it is valid now, else None."""
        digest = _digest(secret)
        # all are compared, in constant time, so that the time of an answer says nothing about the keys
        found = [key for key in self.all() if hmac.compare_digest(key.sha256, digest)]
        return next((key for key in found if key.is_valid(now_s)), None)

    def is_still_valid(self, key: Key, now_s: float) -> bool:
        """Return whether a key found earlier is still valid."""
        return any(other.sha256 == key.sha256 and other.is_valid(now_s) for other in self.all())

    def has_valid_key(self, name: str, now_s: float) -> bool:
        return any(key.name == name and key.is_valid(now_s) for key in self.all())

    def add(self, name: str, scopes: Iterable[str], days: float, now_s: float) -> str:
        """Create a key and return its secret, which is not stored. Raises UsageError if any argument is invalid."""
        scopes = tuple(dict.fromkeys(scopes))
        wrong = [scope for scope in scopes if scope not in list(Scope)]
        if wrong or not scopes:
            raise UsageError(f"--scope: must be some of {', '.join(Scope)}, got {', '.join(wrong) or 'none'}")
        if not 0 < days <= 36_500:
            raise UsageError(f"--days: must be positive and at most 36500, got {days:g}")
        if not name or not name.isprintable() or len(name) > 100:
            raise UsageError(f"NAME: must have 1 to 100 printable characters, got {name!r}")
        secret = _PREFIX + secrets.token_urlsafe(32)
        key = Key(name=name, sha256=_digest(secret), scopes=scopes, created_s=now_s, expires_s=now_s + 86400 * days)

        def added(keys: tuple[Key, ...]) -> tuple[Key, ...]:
            good = [other.id for other in keys if other.name == name and other.is_valid(now_s)]
            if len(good) >= MOST_OF_A_NAME:
                raise UsageError(f"{name!r} already has {len(good)} valid keys, {' and '.join(good)}; revoke one first")
            return (*keys, key)

        self._change(added)
        return secret

    def revoke(self, which: str, now_s: float) -> None:
        """Revoke every key of that name, or the one with that id. Raises UsageError if there is none."""

        def revoked(keys: tuple[Key, ...]) -> tuple[Key, ...]:
            ends = [which in (key.name, key.id) and key.revoked_s is None for key in keys]
            if not any(ends):
                raise UsageError(f"unknown key {which!r}; 'marsupial serve keys list' lists all")
            return tuple(replace(key, revoked_s=now_s) if end else key for key, end in zip(keys, ends, strict=True))

        self._change(revoked)


class KeyFile(Keys):
    """The keys of one data folder; a change takes effect as soon as the file is replaced."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._seen: tuple[int, int, int] | None = None
        self._keys: tuple[Key, ...] = ()

    def all(self) -> tuple[Key, ...]:
        try:
            status = self._path.stat()
        except FileNotFoundError:
            return ()
        # the inode too: a change within one tick of the clock replaces the file
        seen = (status.st_ino, status.st_mtime_ns, status.st_size)
        if seen != self._seen:
            self._keys = _keys_in(self._path.read_text(encoding="utf-8"))
            self._seen = seen
        return self._keys

    def _change(self, change: Callable[[tuple[Key, ...]], tuple[Key, ...]]) -> None:
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with open(self._path.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            text = _document(change(self.all()))
            with private_draft(self._path) as draft:
                draft.write_text(text, encoding="utf-8")


class KeyRow(Keys):
    """The keys of a database that servers share; a change takes effect when its notification arrives."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._keys: tuple[Key, ...] = ()
        store.listen(self._on_news)
        self._read()

    def all(self) -> tuple[Key, ...]:
        return self._keys

    def _on_news(self, topics: frozenset[str] | None) -> None:
        if topics is None or TOPIC in topics:
            self._read()

    def _read(self) -> None:
        self._keys = self._store.read(_stored_keys).result()

    def _change(self, change: Callable[[tuple[Key, ...]], tuple[Key, ...]]) -> None:
        def write(tx: Transaction) -> None:
            tx.lock(_ROW)
            text = _document(change(_stored_keys(tx)))
            documents.store_text(tx, _ROW, text)
            tx.news.add(TOPIC)

        self._store.write(write).result()
        self._read()  # the notification of this change arrives later


@contextmanager
def open_keys(place: str | Path) -> Iterator[Keys]:
    """Open the keys of a folder or database, for a process that only manages keys. Raises StoreError."""
    if isinstance(place, Path):
        yield KeyFile(place)
        return
    store = open_store(place)
    try:
        yield KeyRow(store)
    finally:
        store.close()


def _stored_keys(reader: StoreReader) -> tuple[Key, ...]:
    text = documents.text_of(reader, _ROW)
    return () if text is None else _keys_in(text)


def _keys_in(text: str) -> tuple[Key, ...]:
    return tuple(Key(**{**fields, "scopes": tuple(fields["scopes"])}) for fields in json.loads(text)["keys"])


def _document(keys: Iterable[Key]) -> str:
    return json.dumps({"keys": [asdict(key) for key in keys]}, indent=1)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode(errors="replace")).hexdigest()
