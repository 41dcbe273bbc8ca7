"""The version of the code that answers the inputs of missions.

A process that takes over a mission must repeat what clients have acted on. So each mission has the version of the code
that runs it: the number of the release, and a digest of all that may change an answer (the sources of marsupial and of
the service, Python, the libraries). Two builds that share a number but not their sources are two versions.
"""

import hashlib
from functools import cache

import marsupial
from marsupial.versions import versions


@cache
def code_version() -> str:
    """Return the version of this process's code, such as ``0.1.0+3fa2b1c9``."""
    parts = versions("marsupial_service")
    digest = hashlib.sha256(repr(sorted(parts.items())).encode()).hexdigest()
    return f"{marsupial.__version__}+{digest[:8]}"
