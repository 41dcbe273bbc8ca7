"""The suites of maps for comparisons: one list to tune strategies on, others to test claims about them.

Whoever chooses a parameter of a strategy, or one of two variants, may look at missions of `TUNING` only. Missions of
`PROOF` show how good the result is; one of its maps or seeds that was looked at while tuning moves to `TUNING`.
Missions of `LAST` are run once, before a claim is published, and change nothing but the claim.
A map is drawn by the number in its name (`marsupial.generators.builtin`); the starts on it are drawn by the seeds
of the missions, which begin with `first_seed`.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from marsupial.errors import UsageError
from marsupial.wording import unknown_name

# The defaults of a comparison on a suite.
CARRIERS, ROVERS = "2,4", "2"
RUNS = 3  # missions for each map, team and contender
PLANNER = "anytime"  # what `auto` adds, proofs that makespans are best, saves no time of a mission
CONTENDERS = "heuristic,heuristic-plus,assignment,wurm2010,clairvoyant,temporal"  # all against the last

REAL_FOLDER = Path("../shared/maps")  # maps of real buildings, which are not part of marsupial


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSuite:
    """Maps by name, drawn ones or files of `REAL_FOLDER`, and the first seed of the missions on each."""

    maps: tuple[str, ...]
    first_seed: int
    real: bool = False

    def sources(self) -> list[str]:
        """Return the maps as scenarios are named; raise a `UsageError` if a file is missing."""
        if not self.real:
            return list(self.maps)
        return [str(file) for file in real_files(self.maps, REAL_FOLDER)]


def real_files(names: Iterable[str], folder: Path) -> list[Path]:
    """Return the files of maps of real buildings; raise a `UsageError` if one is missing."""
    files = [folder / f"{name}.yaml" for name in names]
    if missing := [file.name for file in files if not file.is_file()]:
        place = f"they are looked for in {folder.resolve()}; docs/comparisons.md says where to get them"
        raise UsageError(f"maps of real buildings are missing: {', '.join(missing)}; {place}")
    return files


FOOTPRINT = ("partition", "turned", "comb", "cavern", "halls", "spiral", "grid")
PAPER = ("office", "maze")
LASER_TUNING = ("fr079", "cartesium", "warehouse_nav2")
LASER_PROOF = ("fr101", "depot_nav2_fixed", "warehouse_aws", "diag_floor1", "tsc_office")
FLOORS = {
    "kth_a": ("kth_a1", "kth_a2", "kth_a3"),
    "kth_b": ("kth_b1", "kth_b3"),
    "kth_c": ("kth_c0", "kth_c1", "kth_c2"),
}
"""Buildings with several maps, one of each floor. Floors are alike, so a building is whole in one list of maps."""

_BUILDINGS = {floor: building for building, floors in FLOORS.items() for floor in floors}


def building_of(name: str) -> str:
    """Return the building of a floor, and any other map itself."""
    return _BUILDINGS.get(name, name)


def kind_of(name: str) -> str:
    """Return what results of a map are grouped by: the kind of a drawn one, the building of a real one."""
    return re.sub(r"-\d+$", "", building_of(name))


def _buildings(*names: str) -> tuple[str, ...]:
    """Return the maps of buildings, of which those that no other suite uses have a folder of their own."""
    return tuple(f"buildings/{floor}" for name in names for floor in FLOORS.get(name, (name,)))


def _drawn(kinds: Sequence[str], numbers: range) -> tuple[str, ...]:
    """Return names of drawn maps, one of each kind, then the next of each."""
    return tuple(f"{kind}-{number}" for number in numbers for kind in kinds)


TUNING: Mapping[str, MapSuite] = {
    "footprint": MapSuite(maps=_drawn(FOOTPRINT, range(1, 7)), first_seed=1),
    "paper": MapSuite(maps=_drawn(PAPER, range(1, 13)), first_seed=1),
    "laser": MapSuite(maps=LASER_TUNING, first_seed=1, real=True),
    "buildings": MapSuite(maps=LASER_TUNING + _buildings("g4s", "home_sarmis", "kth_c"), first_seed=1, real=True),
}
"""What strategies may be tuned on, by suite."""

PROOF: Mapping[str, MapSuite] = {
    "footprint": MapSuite(maps=_drawn(FOOTPRINT, range(101, 110))[:60], first_seed=1001),
    "paper": MapSuite(maps=_drawn(PAPER, range(101, 113)), first_seed=1001),
    "laser": MapSuite(maps=LASER_PROOF, first_seed=1001, real=True),
    "buildings": MapSuite(maps=LASER_PROOF + _buildings("fr052", "uma236", "kth_b"), first_seed=1001, real=True),
}
"""What no parameter of a strategy has seen, by suite. Footprint: 8 or 9 maps of a kind."""

LAST: Mapping[str, MapSuite] = {
    "buildings": MapSuite(maps=_buildings("movecare_lab", "kth_a"), first_seed=2001, real=True),
}
"""What nobody looks at before the last look. There is none of drawn maps: a new seed draws a new one."""

SUITES: Mapping[str, MapSuite] = {
    **PROOF,
    **{f"{name}-tuning": suite for name, suite in TUNING.items()},
    **{f"{name}-last": suite for name, suite in LAST.items()},
}
"""All suites by the name that `marsupial compare` takes."""


def suite_named(name: str) -> MapSuite:
    """Return a suite; raise a `UsageError` if there is none of this name."""
    if name not in SUITES:
        raise UsageError(unknown_name("suite", name, SUITES))
    return SUITES[name]
