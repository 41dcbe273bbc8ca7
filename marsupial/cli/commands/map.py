"""`marsupial map`: how a map is interpreted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.display.messages import say, warn
from marsupial.cli.options.shared import Json, Quiet, ResolutionOption, keep_inputs, scenario_argument
from marsupial.errors import ScenarioError, UsageError
from marsupial.formats.files import write_bytes, writing
from marsupial.wording import counted

if TYPE_CHECKING:
    from marsupial.maps.describe import MapDescription
    from marsupial.model import Cell, CellArray, Grid, MapReading, RobotType, Scenario


def describe_map(
    file: Annotated[str, scenario_argument("A map, a scenario file or a built-in scenario.", metavar="FILE")],
    json: Json = False,
    out: Annotated[Path | None, typer.Option(help="Write a picture to this file: .png, .svg or .pdf.")] = None,
    picture: Annotated[bool, typer.Option(help="Draw the map as text.")] = True,
    clean: Annotated[
        Path | None,
        typer.Option(metavar="OUT", help="Write the map with obstacle specks smaller than a robot removed."),
    ] = None,
    boundary: Annotated[
        Path | None, typer.Option(metavar="OUT", help="Write the map with a wall along the hull of its obstacles.")
    ] = None,
    resolution: ResolutionOption = None,
    quiet: Quiet = False,
) -> None:
    """Show how a map is interpreted, as a picture and in numbers.

    Reports size, shares of free, occupied and unknown cells, leaks to the border, islands, and reach per robot type. A
    map without a scenario is analysed for the default robot types: carriers of 0.5 m radius, rovers of 0.15 m.

    Example: marsupial map office --out office_map.png
    """
    clean, boundary = _yaml_file(clean), _yaml_file(boundary)
    keep_inputs(file, out=out, clean=clean, boundary=boundary)
    grid, kinds, reading, scenario = _understood(file, resolution)
    # Compiled code takes long to import, so it is imported only when needed.
    from marsupial.cli.display.tables import print_json
    from marsupial.exports.mapclasses import map_classes
    from marsupial.maps.describe import describe

    description = describe(grid, kinds, reading=reading, team=() if scenario is None else scenario.team)
    picture = picture and not json
    if picture or out is not None:
        classes = map_classes(grid, kinds)
        if out is not None:
            _write_picture(out, file, description, grid, classes, scenario)
        if picture:
            _show(classes)
    if json:
        print_json(asdict(description))
    else:
        _print(description)
        for text in description.warnings:
            warn(text)
    if clean is not None:
        _write_clean(clean, grid, kinds)
    if boundary is not None:
        from marsupial.maps.repairs import closed

        _write_map(boundary, closed(grid), "closed along the hull of its obstacles")


def _yaml_file(out: Path | None) -> Path | None:
    """Return the yaml file of a map to write; `out` may lack its suffix."""
    if out is None or out.suffix.lower() in (".yaml", ".yml"):
        return out
    if out.suffix:
        raise UsageError(f"{out}: must end in .yaml; the image is written beside it")
    return out.with_suffix(".yaml")


def _write_clean(out: Path, grid: Grid, kinds: Sequence[RobotType]) -> None:
    from marsupial.maps.describe import cells_below
    from marsupial.maps.repairs import without_specks

    smallest = min(kinds, key=lambda kind: kind.radius_m)
    cleaned, number = without_specks(grid, cells_below(smallest, grid))
    _write_map(out, cleaned, f"without {counted(number, 'speck')} smaller than {smallest.name}")


def _write_map(out: Path, grid: Grid, how: str) -> None:
    """Write a nav2 map: its yaml, and the image beside it."""
    import numpy as np

    from marsupial.formats.mapfiles.nav2 import nav2_files
    from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN

    if not set(np.unique(grid.cells).tolist()) <= {OBSTACLE, FLOOR, UNKNOWN}:
        warn("a nav2 map has no terrain: all of it is written as free")
    for path, data in nav2_files(grid, out).items():
        write_bytes(path, data)
    say(f"wrote {out}, {how}")


def _show(classes: CellArray) -> None:
    """Print the picture, with quarters of characters if the encoding of stdout has them."""
    import sys

    from rich.console import Console

    from marsupial.cli.display.map_picture import QUARTERS, map_picture

    try:
        QUARTERS.encode(sys.stdout.encoding or "ascii")
        blocks = True
    except UnicodeEncodeError:
        blocks = False
    console = Console(file=sys.stdout, highlight=False, markup=False)
    with writing("to stdout"):
        console.print(map_picture(classes, console, blocks=blocks), soft_wrap=not console.is_terminal)
        sys.stdout.flush()


def _write_picture(
    out: Path, file: str, description: MapDescription, grid: Grid, classes: CellArray, scenario: Scenario | None
) -> None:
    from marsupial.exports.style import plain_style

    title = f"{Path(file).stem}: {description.width_m:.4g} m x {description.height_m:.4g} m"
    kind = out.suffix.lower().removeprefix(".")
    starts, text = _starts(scenario)
    with plain_style():
        from marsupial.exports.mapfigure import map_figure

        drawn = map_figure(grid, classes, title, starts, kind=kind, start_text=text, warnings=description.warnings)
    write_bytes(out, drawn)
    say(f"wrote {out}")


def _starts(scenario: Scenario | None, seed: int = 1) -> tuple[dict[str, Cell], str]:
    """Return the start cells of robots with a name for them; none if there is no room."""
    from marsupial.mission.placement import place_team

    try:
        placed = None if scenario is None else place_team(scenario, seed)
    except ScenarioError:  # no room for the team
        placed = None
    if scenario is None or placed is None:
        return {}, ""
    given = [member.start is not None for member in scenario.team if member.carrier is None]
    by_seed = f"drawn by seed {seed if scenario.start_seed is None else scenario.start_seed}"
    text = "start" if all(given) else f"start, given or {by_seed}" if any(given) else f"start, {by_seed}"
    return {robot.name: robot.cell for robot in placed if robot.cell is not None}, text


def _understood(
    file: str, resolution_m: float | None
) -> tuple[Grid, Sequence[RobotType], MapReading | None, Scenario | None]:
    """Return a map, the robot types to describe it for, how its file was read, and its scenario, if any."""
    from marsupial.formats.mapfiles.read import in_folder, read_map
    from marsupial.formats.scenario import is_scenario_file
    from marsupial.generators.builtin import bare_map_scenario, is_builtin
    from marsupial.library.scenarios import load_scenario
    from marsupial.model.robots import default_types

    if is_builtin(file) or is_scenario_file(Path(file)):
        loaded = load_scenario(file, resolution_m=resolution_m)
        return loaded.scenario.grid, loaded.scenario.robot_types, loaded.reading, loaded.scenario
    reading = read_map(in_folder(Path(), file), resolution_m)
    try:
        bare = bare_map_scenario(Path(file).stem, reading.grid)
    except ScenarioError:  # the default robots are too large for it
        bare = None
    return reading.grid, default_types(1), reading, bare


def _print(description: MapDescription) -> None:
    from marsupial.cli.display.map_picture import LEGEND_HEADS, legend_rows
    from marsupial.cli.display.tables import print_facts, print_table

    size = f"{description.width} x {description.height} cells"
    metres = f"{description.width_m:.4g} m x {description.height_m:.4g} m, {description.resolution_m:g} m a cell"
    x, y, yaw = description.origin_m
    print_facts(
        [
            *([("format", description.format)] if description.format else []),
            ("size", f"{size}, {metres}"),
            ("origin", f"x {x:g} m, y {y:g} m, yaw {yaw:g} rad"),
            ("border", _border(description)),
        ]
    )
    shares = (*description.free, description.occupied, description.unknown)
    rows = [(s.name, str(s.cells), f"{s.area_m2:.1f}", f"{s.share:.1%}") for s in shares]
    print_table(("class", "cells", "m2", "share"), rows, right=(1, 2, 3))
    reach = [
        (r.type, f"{r.radius_m:g}", f"{r.area_m2:.1f}", "yes" if r.at_border else "no", str(r.parts))
        for r in description.reach
    ]
    print_table(("robot type", "radius m", "largest reach m2", "gets to the border", "parts"), reach, right=(1, 2, 4))
    if legend := legend_rows(description.legend, {share.code: share.name for share in shares}):
        # The last column is useful only where symbols were joined.
        columns = len(LEGEND_HEADS) - (not any(commonest for *_, commonest in legend))
        print_table(LEGEND_HEADS[:columns], [row[:columns] for row in legend], right=(2,))


def _border(description: MapDescription) -> str:
    if not description.border_cells:
        return "no free cell"
    them = "it" if description.border_cells == 1 else "them"
    cells = counted(description.border_cells, "free cell")
    return f"{cells}, {description.border_area_m2:.4g} m2 connected to {them}"
