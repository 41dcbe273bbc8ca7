"""What names a scenario: a built-in name, or the path of a scenario file or of a map, which gets the default team."""

from __future__ import annotations

import difflib
import warnings
from os import PathLike
from pathlib import Path

from marsupial.errors import ScenarioError
from marsupial.formats.mapfiles.read import READERS, names_recording, read_map
from marsupial.formats.scenario import is_scenario_file, read_scenario, with_team
from marsupial.generators.builtin import (
    DEFAULT_CARRIERS,
    DEFAULT_ROVERS,
    SCENARIOS,
    bare_map_scenario,
    builtin_scenario,
)
from marsupial.model.scenario import Scenario


def scenario(name_or_path: str | PathLike[str], carriers: int | None = None, rovers: int | None = None) -> Scenario:
    """Return a scenario as ``marsupial run`` takes it; what is odd about its map is warned of.

    Parameters
    ----------
    name_or_path
        A built-in name (``marsupial scenarios`` lists them), or the path of a scenario file, a nav2 ``map.yaml``, a
        MovingAI ``.map`` or a recording of ROS 2.
    carriers, rovers
        Another team: carriers, and rovers for each of them; None keeps what the scenario says (2 and 2 without one).

    Raises
    ------
    ScenarioError, MapError
        If there is no such scenario or it can't be used.
    """
    found, oddities = load_scenario(str(name_or_path), carriers, rovers)
    for text in oddities:
        warnings.warn(text, stacklevel=2)
    return found


def load_scenario(source: str, carriers: int | None = None, rovers: int | None = None) -> tuple[Scenario, list[str]]:
    """Return the scenario that `source` names, and warnings about its map; see `scenario`."""
    path = Path(source)
    if source in SCENARIOS:
        return builtin_scenario(source, *_team(carriers, rovers)), []
    if not path.exists() and not names_recording(path):
        raise ScenarioError(_unknown(source))
    if is_scenario_file(path):
        return with_team(read_scenario(path), carriers, rovers), []
    reading = read_map(path)
    oddities = [f"{path}: {text}" for text in reading.warnings]
    return bare_map_scenario(path.stem, reading.grid, *_team(carriers, rovers)), oddities


def _team(carriers: int | None, rovers: int | None) -> tuple[int, int]:
    return DEFAULT_CARRIERS if carriers is None else carriers, DEFAULT_ROVERS if rovers is None else rovers


def _unknown(source: str) -> str:
    path = Path(source)
    siblings = [] if not path.parent.is_dir() else sorted(path.parent.iterdir())
    files = {str(entry) for entry in siblings if entry.suffix.lower() in (*READERS, ".json")}
    close = difflib.get_close_matches(source, sorted({*SCENARIOS, *files}), n=3)
    hint = f"; did you mean {' or '.join(close)}?" if close else f"; built in: {', '.join(SCENARIOS)}"
    return f"{source}: neither a built-in scenario nor a file{hint}"
