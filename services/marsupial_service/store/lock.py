"""One server per folder: a lock that the system lets go of when its holder dies, in whatever way."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from marsupial_service.store.errors import StoreError, StoreInUse


def take(path: Path) -> int:
    """Lock the file at `path`, made if need be, and return its descriptor (closing unlocks). Raises StoreInUse."""
    try:
        fd = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise StoreError(f"{path}: {error.strerror}") from error
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        holder = os.read(fd, 32).decode(errors="replace").strip() or "unknown"
        os.close(fd)
        raise StoreInUse(f"{path.parent} is in use by another server (process {holder})") from None
    os.ftruncate(fd, 0)
    os.write(fd, f"{os.getpid()}\n".encode())
    return fd
