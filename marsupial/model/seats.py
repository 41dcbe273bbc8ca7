"""Which rovers a carrier has places for: `capacity` in all, and of each rover type no more than `seats` names.

A carrier type without `seats` takes rovers of any type. With `seats`, rovers of a type that is not named don't fit on
it. Rovers are given here by the type whose seats they take.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Protocol

from marsupial.wording import counted

Seats = tuple[tuple[str, int], ...]
"""The most rovers of each type that fits; empty where all types fit."""


class Carrying(Protocol):
    """A robot type, of robots on the map or in planning."""

    @property
    def name(self) -> str: ...
    @property
    def capacity(self) -> int: ...
    @property
    def seats(self) -> Seats: ...


def most_aboard(carrier: Carrying, rover: str) -> int:
    """Return how many rovers of a type a carrier can carry at most."""
    return min(carrier.capacity, dict(carrier.seats).get(rover, 0)) if carrier.seats else carrier.capacity


def has_place(carrier: Carrying, rover: str, aboard: Sequence[str]) -> bool:
    """Return whether a carrier with rovers of the types `aboard` has a place for one more, of type `rover`."""
    return len(aboard) < carrier.capacity and (not carrier.seats or aboard.count(rover) < most_aboard(carrier, rover))


def overload(carrier: Carrying, aboard: Sequence[str]) -> str | None:
    """Return why a carrier can't carry rovers of the types `aboard` together, or None."""
    if len(aboard) > carrier.capacity:
        return f"carries {counted(len(aboard), 'rover')}, type {carrier.name!r} has capacity {carrier.capacity}"
    for rover, number in Counter(aboard).items():
        most = most_aboard(carrier, rover)
        if number > most:
            seats = counted(most, "seat") if most else "no seat"
            return f"carries {counted(number, 'rover')} of type {rover!r}, type {carrier.name!r} has {seats} for them"
    return None
