"""Names in PDDL: plain ones are kept, others are escaped so that they can be read back.

PDDL ignores case and allows few characters, and planners fail on objects named like a type or a keyword. Such a name
becomes ``n-`` and its characters, with the code ``-<hex>-`` for each one outside of ``[a-z0-9_]``: ``Room 1`` becomes
``n--52-oom-20-1``, ``home`` becomes ``n-home``. Robot types are objects ``<name>_type``: as in a situation, a type may
have the same name as a robot or place.
"""

import re

from marsupial.formats.pddl.domain import FUNCTIONS, PREDICATES, SUPERTYPES
from marsupial.model import ActionName

TYPE_SUFFIX = "_type"

_PLAIN = re.compile(r"[a-z][a-z0-9_-]*")
_ESCAPED = re.compile(r"n-[a-z0-9_]*(?:-[0-9a-f]+-[a-z0-9_]*)*")

_KEYWORDS = """
    define domain problem objects init goal metric minimize maximize total-time total-cost and or not imply forall
    exists when either object number end over all increase decrease assign scale-up scale-down preference always
    sometime within always-within hold-during hold-after at-most-once sometime-before sometime-after is-violated
    duration undefined oneof unknown
"""

# words with a meaning in the domain or in PDDL
RESERVED = frozenset(["marsupial", *SUPERTYPES, *PREDICATES, *FUNCTIONS, *map(str, ActionName), *_KEYWORDS.split()])


def encode_name(name: str) -> str:
    """Return the PDDL name of a robot or place."""
    if name.endswith(TYPE_SUFFIX):  # it must not look like a type
        return _escape(name.removesuffix(TYPE_SUFFIX)) + "-5f-type"
    return name if _is_plain(name, name) else _escape(name)


def encode_type(name: str) -> str:
    """Return the name of the PDDL object for a robot type."""
    whole = name + TYPE_SUFFIX
    return whole if _is_plain(name, whole) else _escape(name) + TYPE_SUFFIX


def decode_name(word: str) -> str:
    """Return the robot or place with the PDDL name `word`."""
    name = _unescape(word)
    return name if encode_name(name) == word else word


def decode_type(word: str) -> str:
    """Return the robot type whose PDDL object has the name `word`."""
    name = _unescape(word.removesuffix(TYPE_SUFFIX))
    return name if encode_type(name) == word else word


def _is_plain(name: str, whole: str) -> bool:
    return _PLAIN.fullmatch(name) is not None and whole not in RESERVED and not name.startswith("n-")


def _escape(name: str) -> str:
    return "n-" + re.sub(r"[^a-z0-9_]", lambda match: f"-{ord(match[0]):x}-", name)


def _unescape(word: str) -> str:
    if _ESCAPED.fullmatch(word) is None:
        return word
    parts = word.removeprefix("n-").split("-")
    codes = (int(code, 16) for code in parts[1::2])
    letters = [chr(code) if code <= 0x10FFFF else "" for code in codes]
    return "".join(text + letter for text, letter in zip(parts[::2], [*letters, ""], strict=True))
