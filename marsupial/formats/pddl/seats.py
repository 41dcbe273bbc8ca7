"""The seats of carriers in the facts of a PDDL problem of the domain with seats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from marsupial.formats.pddl.domain import WITH_BATTERIES
from marsupial.formats.pddl.facts import seat_pairs
from marsupial.formats.pddl.names import decode_type, encode_name, encode_type
from marsupial.model import Role, Situation
from marsupial.model.seats import Seats

if TYPE_CHECKING:
    from marsupial.formats.pddl.assemble import FactTable


def seats_of(table: FactTable, word: str, carriers: Sequence[str]) -> Seats:
    """Return the seats of a type of carriers: its records, or where no type has any, the facts of its first carrier."""
    recorded = any(key[0] in ("type_seats", "seats_as") for key in (*table.values, *table.facts))
    first = ("type_seats", word) if recorded else ("seats", *carriers[:1])
    found = [(key[2], table.count(key)) for key in table.values if key[:2] == first]
    if not recorded and table.domain == WITH_BATTERIES:  # where all have seats, those that limit nothing are none
        places = table.count(("capacity", *carriers[:1]))
        found = [] if all(number == places for _, number in found) else found
    return tuple((decode_type(rover), number) for rover, number in found if number is not None)


def seats_as(table: FactTable, word: str, rovers: Sequence[str]) -> str:
    """Return the type whose seats rovers of a type take, nothing for their own: by its record or a rover's fact."""
    facts = (key[2] for key in table.facts if key[0] == "fits" and key[1] in rovers)
    found = table.single("seats_as", word) or next(facts, word)
    return "" if found == word else decode_type(found)


def check_seats(table: FactTable, situation: Situation) -> None:
    """Check that the facts about seats say what `situation` says; raise `SituationError` with every other one."""
    wanted: dict[tuple[str, ...], int] = {}
    fits: set[tuple[str, ...]] = set()
    own = table.own()
    for carrier, kind, rover in seat_pairs(situation):
        aboard = [situation.type_of(one.name).seat for one in situation.robots if one.carrier == carrier.name]
        args = own[encode_name(carrier.name)], own[encode_type(kind)]
        wanted["seats", *args] = situation.most_aboard(carrier.name, rover)
        wanted["num_seated", *args] = aboard.count(kind)
        for one in situation.of_role(Role.ROVER):
            if situation.type_of(one.name).seat == kind and situation.most_aboard(carrier.name, one.name):
                fits.add(("fits", own[encode_name(one.name)], args[1], args[0]))
    for key, number in wanted.items():
        if key not in table.values:
            table.wrong(table.lines[key[1]], f"({' '.join(key)}) is missing")
        elif table.count(key) != number:
            table.wrong(table.line_of(key), f"({' '.join(key)}) must be {number}")
    given = {key: line for key, line in table.facts.items() if key[0] == "fits"}
    for fact in sorted(fits - given.keys()):
        table.wrong(table.lines[fact[1]], f"({' '.join(fact)}) is missing")
    for fact in given.keys() - fits:
        table.wrong(given[fact], f"({' '.join(fact)}) contradicts the seats of {fact[-1]}")
    table.check()
