"""`marsupial map`: how a map was understood."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from marsupial.cli.options import Json

if TYPE_CHECKING:
    from marsupial.maps.describe import MapDescription


def describe_map(
    file: Annotated[str, typer.Argument(help="A map, a scenario file or a built-in scenario.")],
    json: Json = False,
) -> None:
    """Say how a map was understood.

    Size, shares of free, occupied and unknown, leaks to the border, reach per robot type. A map without a scenario
    is looked at with the default robot types: carriers of 0.5 m radius, rovers of 0.15 m.

    Example: marsupial map office
    """
    from marsupial.cli.display.messages import warn
    from marsupial.cli.display.tables import print_json

    description = _description(file)
    if json:
        print_json(asdict(description))
        return
    _print(description)
    for text in description.warnings:
        warn(text)


def _description(file: str) -> MapDescription:
    from marsupial.formats.mapfiles.read import read_map
    from marsupial.formats.scenario import is_scenario_file
    from marsupial.generators.builtin import SCENARIOS
    from marsupial.library.scenarios import load_scenario
    from marsupial.maps.describe import describe
    from marsupial.model.robots import default_types

    if file in SCENARIOS or is_scenario_file(Path(file)):
        loaded = load_scenario(file)
        return describe(loaded.scenario.grid, loaded.scenario.robot_types, reading=loaded.reading)
    reading = read_map(file)
    return describe(reading.grid, default_types(1), reading=reading)


def _print(description: MapDescription) -> None:
    from marsupial.cli.display.legend import HEADS as LEGEND_HEADS
    from marsupial.cli.display.legend import legend_rows
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
    legend = legend_rows(description.legend, {share.code: share.name for share in shares})
    if legend:
        wide = any(commonest for *_, commonest in legend)
        columns = len(LEGEND_HEADS) if wide else len(LEGEND_HEADS) - 1
        print_table(LEGEND_HEADS[:columns], [row[:columns] for row in legend], right=(2,))


def _border(description: MapDescription) -> str:
    if not description.border_cells:
        return "no free cell"
    cells = "1 free cell" if description.border_cells == 1 else f"{description.border_cells} free cells"
    them = "it" if description.border_cells == 1 else "them"
    return f"{cells}, {description.border_area_m2:.4g} m2 connected to {them}"
