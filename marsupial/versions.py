"""The versions of everything that the results of this process depend on.

Rows of different versions must not get into one file unnoticed, nor may another version continue a mission.
"""

import hashlib
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba")

ENGINES = ("unified-planning", "up-aries", "up-tamer")
"""Packages that missions depend on besides `LIBRARIES`, if they are installed."""


@cache
def versions(*others: str) -> Mapping[str, str]:
    """Return the versions of all that this process depends on; `others` are packages of ours besides ``marsupial``.

    Those of our packages have a digest of their source files.
    """
    return {
        **{name: f"{_version('marsupial')} (source {_source(name)})" for name in ("marsupial", *others)},
        "Python": platform.python_version(),
        **{name: _version(name) for name in (*LIBRARIES, *ENGINES)},
    }


def _source(package: str) -> str:
    found = find_spec(package)
    if found is None or not found.submodule_search_locations:
        return "none"
    digest = hashlib.sha256()
    folder = Path(found.submodule_search_locations[0])
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:8]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "(none)"
