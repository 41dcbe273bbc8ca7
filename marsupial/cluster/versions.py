"""The versions that a process on a cluster depends on, which must be those of its client.

Rows of different versions must not get into one file unnoticed, nor may another version continue a mission. So requests
to a process of a cluster state requirements, and a process that can't meet them refuses.
"""

import hashlib
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba")

ENGINES = ("unified-planning", "up-aries", "up-tamer")
"""Packages that missions depend on besides `LIBRARIES`, if they are installed."""

OURS = ("marsupial",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirements:
    """Requirements for a process: the same versions and, with `token`, that it serves no client without a token.

    `packages` are the packages of ours whose source files must be equal.
    """

    versions: Mapping[str, str]
    token: bool
    packages: tuple[str, ...] = OURS


class WorkerMismatch(Exception):
    """A worker does not meet the requirements; the message says which machine and why."""


def check_requirements(requirements: Requirements) -> None:
    """Raise `WorkerMismatch` if this process does not meet `requirements`."""
    here = platform.node()
    if requirements.token and os.environ.get("RAY_AUTH_MODE", "").lower() != "token":
        raise WorkerMismatch(f"node {here} accepts clients without a token; start it with RAY_AUTH_MODE=token")
    ours = versions(requirements.packages)
    differences = [f"{name} {ours[name]} instead of {wanted}" for name, wanted in requirements.versions.items()
                   if ours[name] != wanted]  # fmt: skip
    if differences:
        raise WorkerMismatch(f"node {here} has {', '.join(differences)}; install the same versions on all nodes")


@cache
def versions(packages: tuple[str, ...] = OURS) -> Mapping[str, str]:
    """Return the versions of all dependencies of this process, with digests of the source files of `packages`."""
    return {
        **{name: f"{_version('marsupial')} (source {_source(name)})" for name in packages},
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
