"""The names of the engines, so that listing and completing names imports no engine."""

from marsupial import extensions

OWN = ("anytime", "aries", "auto", "exact", "greedy", "tamer")  # as in `engines.ENGINES`


def engine_names() -> tuple[str, ...]:
    """Return the names of all engines: ours first, then the engines of installed packages."""
    return (*OWN, *extensions.extension_names(extensions.ENGINES, OWN))
