"""Names in PDDL: which stand as they are, and how the others are written so that they can be read back.

PDDL knows no capitals and few characters, and planners stumble over objects called like a type or a keyword. A name
that PDDL can't hold is written ``n-`` plus its characters, each one outside ``[a-z0-9_]`` as its code ``-<hex>-``:
``Room 1`` is ``n--52-oom-20-1``, ``home`` is ``n-home``. Robot types are objects named ``<name>_type``, in a name
space of their own as in a situation.
"""

from __future__ import annotations

import re

TYPE_SUFFIX = "_type"

_PLAIN = re.compile(r"[a-z][a-z0-9_-]*")
_ESCAPED = re.compile(r"n-[a-z0-9_]*(?:-[0-9a-f]+-[a-z0-9_]*)*")

_DOMAIN_WORDS = """
    marsupial robot location robot_type carrier rover target waypoint start meeting home
    at on aboard explored can_explore is_a path role_carrier role_rover explores home_of recover_rovers return_home
    num_docked capacity path_cost dock_time undock_time free_at reveal type_capacity type_dock_time type_undock_time
    travel move explore dock undock
"""

_KEYWORDS = """
    define domain problem objects init goal metric minimize maximize total-time total-cost and or not imply forall
    exists when either object number end over all increase decrease assign scale-up scale-down preference always
    sometime within always-within hold-during hold-after at-most-once sometime-before sometime-after is-violated
    duration undefined oneof unknown
"""

RESERVED = frozenset((_DOMAIN_WORDS + _KEYWORDS).split())
"""Words with a meaning of their own in the domain or in PDDL."""


def encode_name(name: str) -> str:
    """Return how a robot or place is called in PDDL."""
    if name.endswith(TYPE_SUFFIX):
        return _escape(name.removesuffix(TYPE_SUFFIX)) + "-5f-type"
    return name if _is_plain(name, name) else _escape(name)


def encode_type(name: str) -> str:
    """Return how the object that stands for a robot type is called in PDDL."""
    whole = name + TYPE_SUFFIX
    return whole if _is_plain(name, whole) else _escape(name) + TYPE_SUFFIX


def decode_name(word: str) -> str:
    """Return the robot or place called `word` in PDDL."""
    name = _unescape(word)
    return name if encode_name(name) == word else word


def decode_type(word: str) -> str:
    """Return the robot type whose object is called `word` in PDDL."""
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
