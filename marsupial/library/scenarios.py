"""Load a scenario by its built-in name, or from a scenario file or a map file, which gets the default team."""

import difflib
import warnings
from contextlib import suppress
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from marsupial.errors import ScenarioError
from marsupial.formats.files import NO_SUCH_FILE, at_home, file_fault, nearby
from marsupial.formats.mapfiles.read import READERS, names_recording, read_map
from marsupial.formats.scenario import is_scenario_file, read_scenario_and_map, with_team
from marsupial.generators.builtin import SCENARIOS, bare_map_scenario, builtin_scenario, is_builtin
from marsupial.model import MapReading, Scenario
from marsupial.model.arguments import path as path_argument
from marsupial.model.arguments import whole


def scenario(name_or_path: str | PathLike[str], carriers: int | None = None, rovers: int | None = None) -> Scenario:
    """Return a scenario as ``marsupial run`` takes it; warn (`warnings`) of what looks wrong about map and starts.

    Parameters
    ----------
    name_or_path
        A built-in name (``marsupial scenarios`` lists them), a drawn map such as ``comb-7``, or the path of a scenario
        file, a nav2 ``map.yaml``, a MovingAI ``.map`` or a recording of ROS 2.
    carriers, rovers
        Number of carriers, and of rovers per carrier; None keeps the scenario's (a map has 2 and 2).

    Raises
    ------
    ScenarioError, MapError
        If there is no such scenario or it can't be used.
    UsageError
        If an argument is no path, or no whole number.
    """
    given = path_argument("scenario", name_or_path)
    carriers = None if carriers is None else whole("carriers", carriers)
    rovers = None if rovers is None else whole("rovers", rovers)
    found = load_scenario(str(name_or_path if isinstance(name_or_path, str) else given), carriers, rovers)
    for text in found.warnings():
        warnings.warn(text, stacklevel=2)
    return found.scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedScenario:
    """A scenario that was loaded."""

    source: str  # its built-in name or path
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
    source: str | PathLike[str] | Scenario, carriers: int | None = None, rovers: int | None = None
) -> LoadedScenario:
    """Return the scenario that `source` is or names; see `scenario`."""
    if isinstance(source, Scenario):
        return LoadedScenario(source=source.name, scenario=with_team(source, carriers, rovers))
    source = str(source)
    path = at_home(source)
    sizes = {"carriers": carriers, "rovers": rovers}
    team: dict[str, Any] = {key: size for key, size in sizes.items() if size is not None}  # others keep their default
    if is_builtin(source):
        return LoadedScenario(source=source, scenario=builtin_scenario(source, **team))
    # A recording may be a folder, or have a topic behind its path: `read_map` checks it.
    if (fault := None if names_recording(path) else file_fault(path)) is not None:
        raise ScenarioError(_unknown(source)) if fault == NO_SUCH_FILE else ScenarioError(fault, source=source)
    if is_scenario_file(path):
        written, reading = read_scenario_and_map(path)
        return LoadedScenario(source=source, scenario=with_team(written, carriers, rovers), reading=reading)
    reading = read_map(path)
    return LoadedScenario(source=source, scenario=bare_map_scenario(path.stem, reading.grid, **team), reading=reading)


def _unknown(source: str) -> str:
    path = Path(source)
    siblings: list[Path] = []
    with suppress(OSError):
        siblings = sorted(path.parent.iterdir())
    files = {str(entry) for entry in siblings if entry.suffix.lower() in (*READERS, ".json")}
    meant = nearby(Path(), source)
    close = [meant] if meant else difflib.get_close_matches(source, sorted({*SCENARIOS, *files}), n=3)
    hint = f"; did you mean {' or '.join(close)}?" if close else f"; built in: {', '.join(SCENARIOS)}"
    return f"{source}: neither a built-in scenario nor a file{hint}"
