"""The instances of the planner suite: random floors, and moments of missions on built-in maps, each in a file.

The suite is fixed: an instance never changes its name or its situation. Any change is a new instance and a new
`VERSION`; results of different versions are not compared. How they were made: ``benchmarks/floors.py``.
"""

import gzip
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.resources import files

from marsupial.formats.situation import situation_from_json
from marsupial.model.situation import Situation

VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Instance:
    """One instance of the suite."""

    name: str
    team: str  # carriers x rovers of each
    targets: int
    family: str
    situation: Callable[[], Situation]  # returns its situation, the same every time


FAMILIES: Mapping[str, tuple[str, ...]] = {
    # rooms for rovers only, with one door each
    "rooms": ("rooms-1x1-3", "rooms-1x2-5", "rooms-2x2-8", "rooms-3x2-12", "rooms-6x3-20", "rooms-12x3-50",
              "rooms-34x3-150"),
    # two doors on opposite sides of wide rooms: a rover crosses quickly, a carrier has to drive around
    "two-doors": ("two-doors-2x1-6", "two-doors-2x2-8", "two-doors-4x3-16", "two-doors-6x3-20", "two-doors-34x3-150"),
    # fewer rovers than rover-only rooms: they must be picked up, used again, and be aboard at the end
    "pressure": ("pressure-1x1-3", "pressure-2x1-6", "pressure-2x2-8", "pressure-6x3-22", "pressure-12x3-50",
                 "pressure-34x3-150"),
    # at the end rovers are aboard and carriers at their start; in some, rovers drive in corridors too
    "homes": ("homes-1x2-5", "homes-2x2-8", "homes-4x3-16", "homes-6x3-20"),
    # some carriers are busy, and half of the rovers are on the ground in rooms
    "in-flight": ("in-flight-2x2-8", "in-flight-3x2-12", "in-flight-6x3-20"),
    # moments of missions with the greedy planner; at the last only 17 rovers are left to pick up
    "missions": ("mission-lobby-1x2-5", "mission-rooms-1x1-11", "mission-office-2x2-8", "mission-office-2x2-17",
                 "mission-maze-2x2-16", "mission-cave-2x2-42", "mission-random-3x2-30", "mission-rooms-4x3-20",
                 "mission-office-6x3-18", "mission-cave-6x3-21", "mission-office-6x3-0"),
}  # fmt: skip


def _all() -> Iterator[Instance]:
    for family, names in FAMILIES.items():
        for name in names:
            team, targets = name.split("-")[-2:]
            yield Instance(name=name, team=team, targets=int(targets), family=family, situation=partial(_stored, name))


def _stored(name: str) -> Situation:
    data = (files("marsupial.bench.suite") / "moments" / f"{name}.json.gz").read_bytes()
    return situation_from_json(gzip.decompress(data).decode())


INSTANCES: Mapping[str, Instance] = {instance.name: instance for instance in _all()}
