"""The instances of the planner suite: random floors by seed, and moments of missions on built-in maps.

The suite is fixed: an instance never changes its name or its situation. Any change is a new instance and a new
`VERSION`; results of different versions are not compared.
"""

import gzip
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files

from marsupial.bench.suite.floors import Floor
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


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionMoment:
    """A moment of a mission with the greedy planner, `at_ms` after its start, stored in a file."""

    # Missions change with every change of marsupial, the stored moments do not.
    scenario: str
    carriers: int
    rovers: int  # of each carrier
    seed: int
    at_ms: int
    targets: int
    recover: bool = False  # whether all rovers must be aboard at the end, which the mission did not ask for yet

    @property
    def name(self) -> str:
        return f"mission-{self.scenario}-{self.carriers}x{self.rovers}-{self.targets}"

    def situation(self) -> Situation:
        data = (files("marsupial.bench.suite") / "moments" / f"{self.name}.json.gz").read_bytes()
        return situation_from_json(gzip.decompress(data).decode())


ROOMS = (
    Floor(seed=11, carriers=1, rovers=1, targets=3, rooms=1),
    Floor(seed=12, carriers=1, rovers=2, targets=5, rooms=2),
    Floor(seed=13, carriers=2, rovers=2, targets=8, rooms=4),
    Floor(seed=14, carriers=3, rovers=2, targets=12, rooms=5),
    Floor(seed=15, carriers=6, rovers=3, targets=20, rooms=8, scattered=True),
    Floor(seed=16, carriers=12, rovers=3, targets=50, rooms=20, scattered=True),
    Floor(seed=17, carriers=34, rovers=3, targets=150, rooms=50, scattered=True),
)
"""Rooms for rovers only, with one door each."""

TWO_DOORS = (
    Floor(seed=21, carriers=2, rovers=1, targets=6, rooms=3, doors=2, lot_ms=(20_000, 6_000)),
    Floor(seed=22, carriers=2, rovers=2, targets=8, rooms=4, doors=2, lot_ms=(20_000, 6_000), recover=True),
    Floor(seed=23, carriers=4, rovers=3, targets=16, rooms=6, doors=2, lot_ms=(20_000, 6_000)),
    Floor(seed=24, carriers=6, rovers=3, targets=20, rooms=6, doors=2, lot_ms=(20_000, 6_000), recover=True,
          scattered=True),
    Floor(seed=25, carriers=34, rovers=3, targets=150, rooms=50, doors=2, lot_ms=(20_000, 6_000), scattered=True),
)  # fmt: skip
"""Two doors on opposite sides of wide rooms: a rover crosses quickly, a carrier has to drive around."""

PRESSURE = (
    Floor(seed=31, carriers=1, rovers=1, targets=3, rooms=2, recover=True),
    Floor(seed=32, carriers=2, rovers=1, targets=6, rooms=5, recover=True),
    Floor(seed=33, carriers=2, rovers=2, targets=8, rooms=7, recover=True),
    Floor(seed=34, carriers=6, rovers=3, targets=22, rooms=20, recover=True),
    Floor(seed=35, carriers=12, rovers=3, targets=50, rooms=45, recover=True, scattered=True),
    Floor(seed=36, carriers=34, rovers=3, targets=150, rooms=135, recover=True, scattered=True),
)
"""Fewer rovers than rover-only rooms: they must be picked up, used again, and be aboard at the end."""

HOMES = (
    Floor(seed=41, carriers=1, rovers=2, targets=5, rooms=2, recover=True, homes=True, roaming=True),
    Floor(seed=42, carriers=2, rovers=2, targets=8, rooms=4, recover=True, homes=True),
    Floor(seed=43, carriers=4, rovers=3, targets=16, rooms=6, recover=True, homes=True, roaming=True),
    Floor(seed=144, carriers=6, rovers=3, targets=20, rooms=12, recover=True, homes=True, scattered=True),
)
"""At the end rovers are aboard and carriers at their start; roaming rovers drive in corridors too."""

IN_FLIGHT = (
    Floor(seed=51, carriers=2, rovers=2, targets=8, rooms=5, in_flight=True),
    Floor(seed=52, carriers=3, rovers=2, targets=12, rooms=7, in_flight=True, recover=True),
    Floor(seed=53, carriers=6, rovers=3, targets=20, rooms=10, in_flight=True, recover=True, scattered=True),
)
"""Some carriers are busy, and half of the rovers are on the ground in rooms."""

MISSIONS: tuple[MissionMoment, ...] = (
    MissionMoment(scenario="lobby", carriers=1, rovers=2, seed=1, at_ms=3_000, targets=5),
    MissionMoment(scenario="rooms", carriers=1, rovers=1, seed=1, at_ms=75_024, targets=11),
    MissionMoment(scenario="office", carriers=2, rovers=2, seed=1, at_ms=134_686, targets=8),
    MissionMoment(scenario="office", carriers=2, rovers=2, seed=1, at_ms=220_336, targets=17, recover=True),
    MissionMoment(scenario="maze", carriers=2, rovers=2, seed=2, at_ms=111_368, targets=16),
    MissionMoment(scenario="cave", carriers=2, rovers=2, seed=1, at_ms=112_434, targets=42),
    MissionMoment(scenario="random", carriers=3, rovers=2, seed=1, at_ms=58_843, targets=30),
    MissionMoment(scenario="rooms", carriers=4, rovers=3, seed=1, at_ms=40_864, targets=20),
    MissionMoment(scenario="office", carriers=6, rovers=3, seed=1, at_ms=49_993, targets=18),
    MissionMoment(scenario="cave", carriers=6, rovers=3, seed=1, at_ms=68_273, targets=21, recover=True),
    MissionMoment(scenario="office", carriers=6, rovers=3, seed=1, at_ms=168_363, targets=0),
)
"""Moments of missions with the greedy planner and 8 steps; at the last only 17 rovers are left to pick up."""

FAMILIES: Mapping[str, tuple[Floor | MissionMoment, ...]] = {
    "rooms": ROOMS,
    "two-doors": TWO_DOORS,
    "pressure": PRESSURE,
    "homes": HOMES,
    "in-flight": IN_FLIGHT,
    "missions": MISSIONS,
}


def _all() -> Iterator[Instance]:
    for family, sources in FAMILIES.items():
        for source in sources:
            team = f"{source.carriers}x{source.rovers}"
            name = source.name if isinstance(source, MissionMoment) else f"{family}-{team}-{source.targets}"
            yield Instance(name=name, team=team, targets=source.targets, family=family, situation=source.situation)


INSTANCES: Mapping[str, Instance] = {instance.name: instance for instance in _all()}
