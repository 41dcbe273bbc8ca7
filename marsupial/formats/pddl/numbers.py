"""Numbers in PDDL and plan texts, exact and bounded: ``1e1000000`` alone would fill the memory."""

from __future__ import annotations

import re
from fractions import Fraction

from marsupial.model.bounds import MOST

_NUMBER = re.compile(r"[-+]?[0-9./]{1,1100}(?:[eE][-+]?[0-9]{1,3})?")


def exact(text: str) -> Fraction:
    """Return the number that a text holds: decimal, with an exponent, or a fraction (``1/3``).

    Raises
    ------
    ValueError
        If it holds none, one of more than 1100 digits, or one beyond `MOST`.
    """
    if _NUMBER.fullmatch(text) is None:
        raise ValueError(f"{text[:40]!r} is no number of at most 1100 digits")
    try:
        value = Fraction(text)
    except ZeroDivisionError:
        raise ValueError(f"{text!r} divides by zero") from None
    if abs(value) > MOST:
        raise ValueError(f"{text} is more than {MOST:g}")
    return value
