"""API keys: who may ask for what, until when. Only hashes of them are kept, in one file that a server rereads.

A key is shown once, when it is made. The file is replaced as a whole, so that any reader sees all of a change
or nothing.
"""

from __future__ import annotations

import fcntl
import hashlib
import hmac
import json
import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path

from marsupial.errors import UsageError

FILE = "keys.json"
_PREFIX = "msp_"


class Scope(StrEnum):
    """What a key allows."""

    PLAN = "plan"
    MISSION = "mission"
    ADMIN = "admin"


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A key as it is kept; `name` says whose jobs are whose. Times in seconds since 1970."""

    name: str
    sha256: str
    scopes: tuple[str, ...]
    created_s: float
    expires_s: float
    revoked_s: float | None = None

    def holds(self, now_s: float) -> bool:
        """Say whether it is good at that moment."""
        return self.revoked_s is None and now_s < self.expires_s


class KeyFile:
    """The keys of one data folder."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._seen: tuple[int, int, int] | None = None
        self._keys: tuple[Key, ...] = ()

    def all(self) -> tuple[Key, ...]:
        """Return all keys, the expired and revoked ones too."""
        try:
            status = self._path.stat()
        except FileNotFoundError:
            return ()
        seen = (status.st_ino, status.st_mtime_ns, status.st_size)
        if seen != self._seen:
            documents = json.loads(self._path.read_text(encoding="utf-8"))["keys"]
            self._keys = tuple(Key(**{**fields, "scopes": tuple(fields["scopes"])}) for fields in documents)
            self._seen = seen
        return self._keys

    def find(self, secret: str, now_s: float) -> Key | None:
        """Return the key of that secret if it is good now; all are compared, so that the time tells nothing."""
        digest = _digest(secret)
        found = [key for key in self.all() if hmac.compare_digest(key.sha256, digest)]
        return next((key for key in found if key.holds(now_s)), None)

    def is_good(self, key: Key, now_s: float) -> bool:
        """Say whether a key that was found is still good."""
        return any(other.sha256 == key.sha256 and other.holds(now_s) for other in self.all())

    def add(self, name: str, scopes: Iterable[str], days: float, now_s: float) -> str:
        """Make a key and return its secret, which is kept nowhere. Raises UsageError if any argument is wrong."""
        scopes = tuple(dict.fromkeys(scopes))
        wrong = [scope for scope in scopes if scope not in list(Scope)]
        if wrong or not scopes:
            raise UsageError(f"--scope: must be some of {', '.join(Scope)}, got {', '.join(wrong) or 'none'}")
        if not 0 < days <= 36_500:
            raise UsageError(f"--days: must be from 0 to 36500, got {days:g}")
        if not name or not name.isprintable() or len(name) > 100:
            raise UsageError("a key's name has 1 to 100 printable characters")
        secret = _PREFIX + secrets.token_urlsafe(32)
        key = Key(name=name, sha256=_digest(secret), scopes=scopes, created_s=now_s, expires_s=now_s + 86400 * days)
        with self._changing() as keys:
            if any(other.name == name and other.holds(now_s) for other in keys):
                raise UsageError(f"there is a key {name!r} already; revoke it first")
            keys.append(key)
        return secret

    def revoke(self, name: str, now_s: float) -> None:
        """Make every key of that name useless. Raises UsageError if there is none."""
        with self._changing() as keys:
            if not any(key.name == name and key.revoked_s is None for key in keys):
                raise UsageError(f"there is no key {name!r}")
            keys[:] = [replace(k, revoked_s=now_s) if k.name == name and k.revoked_s is None else k for k in keys]

    @contextmanager
    def _changing(self) -> Iterator[list[Key]]:
        """Yield the keys to be changed; they are written if nothing is raised."""
        self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with open(self._path.with_suffix(".lock"), "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            keys = list(self.all())
            yield keys
            draft = self._path.with_suffix(".draft")
            with open(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
                json.dump({"keys": [asdict(key) for key in keys]}, file, indent=1)
                file.flush()
                os.fsync(file.fileno())
            os.replace(draft, self._path)


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode(errors="replace")).hexdigest()
