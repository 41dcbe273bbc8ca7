"""The fields ``keepout`` and ``speed`` of a map: nav2 maps that become terrain (`mapfiles.filter_masks`).

Scenario files and the settings of `marsupial ros` share them.
"""

from __future__ import annotations

from pathlib import Path

from marsupial.errors import MapError, Problem
from marsupial.formats.fields import Fields, unknown
from marsupial.formats.mapfiles.filter_masks import BASE, MULTIPLIER, FilterMasks, KeepoutMask, SpeedMask
from marsupial.formats.mapfiles.nav2 import read_occupancy
from marsupial.formats.mapfiles.occupancy import Occupancy
from marsupial.model.bounds import Bound
from marsupial.model.grid import OBSTACLE, Terrain

KEYS = ("keepout", "speed")

PERCENT = Bound(0, 100, "%", above=True)


def read_filters(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> FilterMasks:
    """Read the masks of a ``map``, with paths relative to `folder`; they are valid only if no problem was noted."""
    keepout = _read_keepout(fields.part("keepout"), terrains, folder) if fields.has("keepout") else None
    speed = _read_speed(fields.part("speed"), terrains, folder) if fields.has("speed") else None
    return FilterMasks(keepout=keepout, speed=speed)


def _mask(fields: Fields, folder: Path, file: str) -> Occupancy | None:
    """Return the mask that ``file`` names; None, with its problems noted, if it can't be read."""
    if not file:
        return None
    try:
        return read_occupancy(folder / file)
    except MapError as error:
        note_file(fields, "file", error)
        return None


def note_file(fields: Fields, key: str, error: MapError) -> None:
    """Note the problems of a file that a field names, with the file's path if it is known."""
    for problem in error.problems:
        text = f"{error.source}: {problem}" if error.source else str(problem)
        fields.problems.append(Problem(fields.at(key), text))


def _read_keepout(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> KeepoutMask | None:
    file = fields.text("file")
    code = _code(fields, "terrain", fields.text("terrain"), terrains)
    fields.finish()
    occupancy = _mask(fields, folder, file)
    return None if occupancy is None or code is None else KeepoutMask(occupancy=occupancy, code=code)


def _read_speed(fields: Fields, terrains: tuple[Terrain, ...], folder: Path) -> SpeedMask | None:
    file = fields.text("file")
    steps = fields.part("terrains")
    percents = {}
    for name in steps.data:
        percent = steps.number(name, None, PERCENT)
        if (code := _code(steps, str(name), str(name), terrains)) is not None:
            percents[code] = percent
    base, multiplier = fields.number("base", BASE), fields.number("multiplier", MULTIPLIER)
    fields.finish()
    occupancy = _mask(fields, folder, file)
    if occupancy is None:
        return None
    return SpeedMask(occupancy=occupancy, percents=percents, base=base, multiplier=multiplier)


def _code(fields: Fields, key: str, name: str, terrains: tuple[Terrain, ...]) -> int | None:
    """Return the code of a terrain other than obstacle; None, with a problem noted, if there is none of that name."""
    codes = {terrain.name: terrain.code for terrain in terrains if terrain.code != OBSTACLE}
    if name and name not in codes:
        fields.wrong(key, unknown("terrain", name, codes))
    return codes.get(name)
