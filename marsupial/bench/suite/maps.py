"""The suites of maps for comparisons: one list to tune strategies on, the other to test claims about them.

Whoever chooses a parameter of a strategy, or one of two variants, may look at missions of `TUNING` only. Missions of
`PROOF` show how good the result is; one of its maps or seeds that was looked at while tuning moves to `TUNING`.
A map is drawn by the number in its name (`marsupial.generators.builtin`); the starts on it are drawn by the seeds
of the missions, which begin with `first_seed`.
"""

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

LASER_FOLDER = Path("../shared/maps")  # laser maps of real buildings, which are not part of marsupial


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSuite:
    """Maps by name, drawn ones or files of `LASER_FOLDER`, and the first seed of the missions on each."""

    maps: tuple[str, ...]
    first_seed: int
    laser: bool = False

    def sources(self) -> list[str]:
        """Return the maps as scenarios are named; raise a `UsageError` if a laser map is missing."""
        if not self.laser:
            return list(self.maps)
        return [str(file) for file in laser_files(self.maps, LASER_FOLDER)]


def laser_files(names: Iterable[str], folder: Path) -> list[Path]:
    """Return the files of laser maps; raise a `UsageError` if one is missing."""
    files = [folder / f"{name}.yaml" for name in names]
    if missing := [file.name for file in files if not file.is_file()]:
        place = f"they are looked for in {folder.resolve()}; docs/comparisons.md says where to get them"
        raise UsageError(f"laser maps are missing: {', '.join(missing)}; {place}")
    return files


FOOTPRINT = ("partition", "turned", "comb", "cavern", "halls", "spiral", "grid")
PAPER = ("office", "maze")


def _drawn(kinds: Sequence[str], numbers: range) -> tuple[str, ...]:
    """Return names of drawn maps, one of each kind, then the next of each."""
    return tuple(f"{kind}-{number}" for number in numbers for kind in kinds)


TUNING: Mapping[str, MapSuite] = {
    "footprint": MapSuite(maps=_drawn(FOOTPRINT, range(1, 7)), first_seed=1),
    "paper": MapSuite(maps=_drawn(PAPER, range(1, 13)), first_seed=1),
    "laser": MapSuite(maps=("fr079", "cartesium", "warehouse_nav2"), first_seed=1, laser=True),
}
"""What strategies may be tuned on, by suite."""

PROOF: Mapping[str, MapSuite] = {
    "footprint": MapSuite(maps=_drawn(FOOTPRINT, range(101, 110))[:60], first_seed=1001),
    "paper": MapSuite(maps=_drawn(PAPER, range(101, 113)), first_seed=1001),
    "laser": MapSuite(
        maps=("fr101", "depot_nav2_fixed", "warehouse_aws", "diag_floor1", "tsc_office"), first_seed=1001, laser=True
    ),
}
"""What no parameter of a strategy has seen, by suite. Footprint: 8 or 9 maps of a kind."""

SUITES: Mapping[str, MapSuite] = {**PROOF, **{f"{name}-tuning": suite for name, suite in TUNING.items()}}
"""All suites by the name that `marsupial compare` takes."""


def suite_named(name: str) -> MapSuite:
    """Return a suite; raise a `UsageError` if there is none of this name."""
    if name not in SUITES:
        raise UsageError(unknown_name("suite", name, SUITES))
    return SUITES[name]
