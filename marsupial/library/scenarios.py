"""Load a scenario by its built-in name, or from a scenario file or a map file, which gets the default team."""

import warnings
from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from marsupial.errors import ScenarioError, UsageError
from marsupial.formats.files import NO_SUCH_FILE, at_home, file_fault, nearby
from marsupial.formats.mapfiles.read import READERS, check_scaleless, names_recording, read_map
from marsupial.formats.scenario import is_scenario_file, read_scenario_and_map, with_team
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario, is_builtin
from marsupial.model import UNKNOWN, Grid, MapReading, Scenario
from marsupial.model.arguments import number, whole
from marsupial.model.arguments import path as path_argument
from marsupial.model.bounds import BOUNDS
from marsupial.model.grid import TERRAINS
from marsupial.wording import closest

ARRAY = "array"  # the name of a scenario that is an array


Source = str | PathLike[str] | Scenario | np.ndarray[Any, Any]
"""What a caller may give as a scenario; an array is a map."""


def scenario(
    name_or_path: str | PathLike[str] | np.ndarray[Any, Any],
    carriers: int | None = None,
    rovers: int | None = None,
    *,
    resolution_m: float | None = None,
) -> Scenario:
    """Return a scenario as ``marsupial run`` takes it; warn (`warnings`) of what looks wrong about map and starts.

    Parameters
    ----------
    name_or_path
        A built-in name (``marsupial scenarios`` lists them), a drawn map such as ``comb-7``, or the path of a scenario
        file, a nav2 ``map.yaml``, a MovingAI ``.map``, an image or a recording of ROS 2. Or the map itself as an array
        of whole numbers or booleans, shape (height, width), row 0 the lowest: 0 obstacle, 1 floor, 2 rough ground, 255
        unknown.
    carriers, rovers
        Number of carriers, and of rovers per carrier; None keeps the scenario's (a map has 2 and 2).
    resolution_m
        Edge of a cell in metres, which arrays and images need, and MovingAI maps may have (default 1 m).

    Returns
    -------
    Scenario
        With the default robot types and team if it is a map alone.

    Raises
    ------
    ScenarioError, MapError
        If there is no such scenario or it can't be used.
    UsageError
        If an argument is no path, array or whole number, or the resolution is missing or too much.

    Examples
    --------
    ::

        room = numpy.pad(numpy.ones((80, 120), dtype=numpy.uint8), 1)  # walls around
        room[:40, 60] = 0
        marsupial.explore(marsupial.scenario(room, resolution_m=0.1))
    """
    carriers = None if carriers is None else whole("carriers", carriers)
    rovers = None if rovers is None else whole("rovers", rovers)
    resolution_m = None if resolution_m is None else number("resolution_m", resolution_m, BOUNDS["resolution_m"])
    if not isinstance(name_or_path, str | np.ndarray):
        name_or_path = path_argument("scenario", name_or_path)
    found = load_scenario(name_or_path, carriers, rovers, resolution_m)
    for text in found.warnings():
        warnings.warn(text, stacklevel=2)
    return found.scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedScenario:
    """A scenario that was loaded."""

    source: str  # its built-in name or path, or `ARRAY`
    scenario: Scenario  # the scenario, with the team asked for
    reading: MapReading | None = None  # how its map file was interpreted, None if there is none

    def warnings(self) -> list[str]:
        """Return what looks wrong about map and starts, each with the name of the file; this analyses the whole map."""
        if is_builtin(self.source):
            return []
        from marsupial.maps.describe import describe  # imports numba

        one = self.scenario
        found = describe(one.grid, one.robot_types, reading=self.reading, team=one.team)
        return [f"{self.source}: {text}" for text in found.warnings]


def load_scenario(
    source: Source, carriers: int | None = None, rovers: int | None = None, resolution_m: float | None = None
) -> LoadedScenario:
    """Return the scenario that `source` is or names; see `scenario`."""
    sizes = {"carriers": carriers, "rovers": rovers}
    team: dict[str, Any] = {key: size for key, size in sizes.items() if size is not None}  # others keep their default
    if isinstance(source, np.ndarray):
        return LoadedScenario(source=ARRAY, scenario=bare_map_scenario(ARRAY, _grid_of(source, resolution_m), **team))
    if isinstance(source, Scenario):
        return LoadedScenario(source=source.name, scenario=with_team(source, carriers, rovers))
    source = str(source)
    path = at_home(source)
    if is_builtin(source):
        check_scaleless(source, resolution_m)
        return LoadedScenario(source=source, scenario=builtin_scenario(source, **team))
    # A recording may be a folder, or have a topic behind its path: `read_map` checks it.
    if (fault := None if names_recording(path) else file_fault(path)) is not None:
        raise ScenarioError(_unknown(source)) if fault == NO_SUCH_FILE else ScenarioError(fault, source=source)
    if is_scenario_file(path):
        check_scaleless(source, resolution_m)
        written, reading = read_scenario_and_map(path)
        return LoadedScenario(source=source, scenario=with_team(written, carriers, rovers), reading=reading)
    reading = read_map(path, resolution_m)
    return LoadedScenario(source=source, scenario=bare_map_scenario(path.stem, reading.grid, **team), reading=reading)


def _grid_of(array: np.ndarray[Any, Any], resolution_m: float | None) -> Grid:
    if resolution_m is None:
        raise UsageError("resolution_m: an array needs the edge of its cells in metres, as in resolution_m=0.05")
    if array.ndim != 2 or array.dtype.kind not in "biu":
        raise UsageError(f"scenario: must be a 2-d array of whole numbers, got {array.dtype} {array.shape}")
    codes = (*(terrain.code for terrain in TERRAINS), UNKNOWN)
    if other := sorted(set(np.unique(array).tolist()) - set(codes)):
        meanings = ", ".join(f"{terrain.code} {terrain.name}" for terrain in TERRAINS)
        raise UsageError(f"scenario: cells must be {meanings} or {UNKNOWN} unknown, got {other[0]}")
    return Grid(cells=array.astype(np.uint8), resolution_m=resolution_m)


def _unknown(source: str) -> str:
    path = Path(source)
    siblings: list[Path] = []
    with suppress(OSError):
        siblings = sorted(path.parent.iterdir())
    names = {entry.name for entry in siblings if entry.suffix.lower() in (*READERS, ".json")}
    close = closest(path.name, names if "/" in source else {*SCENARIOS, *names})
    meant = nearby(Path(), source) or (close and str(path.parent / close))
    hint = f", did you mean {meant!r}?" if meant else f"; built in: {', '.join(SCENARIOS)}"
    return f"{source}: neither a built-in scenario nor a file{hint}"
