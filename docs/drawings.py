"""Draws the pictures of concepts and gallery, from missions as they are: `python docs/drawings.py` in a checkout.

Each picture is drawn by one function below and written to `docs/pictures/`. The same code draws the same picture on
every machine, but for what versions of matplotlib do differently.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from functools import cache
from itertools import chain, cycle
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import marsupial
from marsupial.arrays import Floats
from marsupial.exports.drawing import MARKERS
from marsupial.exports.ground import ground_image
from marsupial.exports.style import plain_style
from marsupial.exports.trails import drives
from marsupial.library.exploring import Exploration
from marsupial.library.missions import reachable_area
from marsupial.maps.growth import reach_of
from marsupial.maps.survey import placed
from marsupial.maps.territory import Territory
from marsupial.mission.playback import Playback
from marsupial.mission.rebuild import Moment, moment_at
from marsupial.model.grid import UNKNOWN, Cell, Grid, Mask
from marsupial.model.mission import ActionEnded
from marsupial.model.robots import RobotType, Role, TeamMember
from marsupial.model.scenario import Goal, Scenario
from marsupial.replay.palette import LIGHT, REACH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CARRIER, ROVER = (family[0] for family in LIGHT.families[:2])
"""Colours of two things that are told apart, of the palette that all pictures have."""


def step() -> Figure:
    """The best plan after so many steps, by two planners, for one moment of a mission."""
    from matplotlib.figure import Figure

    situation = _mission("heuristic").situation(at_s=96)
    figure = Figure(figsize=(7, 3.4), layout="constrained")
    axes = figure.subplots()
    for planner, colour in (("greedy", ROVER), ("anytime", CARRIER)):
        counts = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512)
        spans = [_makespan_s(situation, planner, count) for count in counts]
        axes.step(counts, spans, where="post", color=colour, marker="o", label=planner)
    axes.set_xscale("log", base=2)
    axes.set_xticks(counts, [str(count) for count in counts])
    axes.set_xlabel("steps: the same on every machine")
    axes.set_ylabel("makespan of the best plan [s]")
    axes.set_title(
        f"One moment of office: {len(situation.targets)} targets, {len(situation.robots)} robots", loc="left"
    )
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def target() -> Figure:
    """Frontier cells, joined to targets that are seen at once, and where a robot goes for each."""
    moment = _moment()
    survey = moment.survey()
    figure, axes = _map_figure(moment.grid)
    width = moment.grid.width
    handles = []
    for number, (found, (colour, *_)) in enumerate(zip(survey.targets, cycle(LIGHT.families), strict=False)):
        axes.plot(found.cells % width, found.cells // width, "s", color=colour, markersize=2.6)
        who = " or ".join(sorted(found.viewpoints))
        (handle,) = axes.plot(
            *_centre(next(iter(found.viewpoints.values()))),
            "D",
            color=colour,
            markeredgecolor="black",
            markersize=8,
            label=f"T{number + 1}: for a {who}, {found.reveal_m2:.0f} m² may come to light",
        )
        axes.annotate(
            f"T{number + 1}", handle.get_xydata()[0], xytext=(7, 5), textcoords="offset points", weight="bold"
        )
        handles.append(handle)
    _draw_robots(axes, moment)
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False)
    axes.set_title("Frontier cells (squares) make targets; diamonds are where a robot goes to look", loc="left")
    return figure


def meeting_point() -> Figure:
    """What each type reaches, and the pairs of poses where a rover changes between ground and carrier."""
    moment = _moment()
    survey, grid = moment.survey(), moment.grid
    reach = _reach(moment)
    figure, axes = _map_figure(grid)
    _shade(axes, reach["rover"] & ~reach["carrier"], REACH["rovers"])
    _shade(axes, reach["carrier"], REACH["carriers"])
    for point in survey.meetings:
        carrier, rover = _centre(point.carrier_cell), _centre(point.rover_cell)
        axes.plot(*zip(carrier, rover, strict=True), color="black", linewidth=1.2, zorder=3)
        axes.plot(*carrier, marker="s", color=CARRIER, markeredgecolor="black", markersize=10, zorder=4)
        axes.plot(*rover, marker="o", color=ROVER, markeredgecolor="black", markersize=7, zorder=4)
    _draw_robots(axes, moment)
    handles = [
        axes.plot([], [], "s", color=REACH["carriers"], markersize=12, label="a carrier can stand here")[0],
        axes.plot([], [], "s", color=REACH["rovers"], markersize=12, label="only a rover can")[0],
        axes.plot([], [], "s", color=CARRIER, markeredgecolor="black", markersize=9, label="meeting: the carrier")[0],
        axes.plot([], [], "o", color=ROVER, markeredgecolor="black", label="meeting: the rover")[0],
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False)
    axes.set_title("Meeting points stand on the border of what only rovers reach", loc="left")
    return figure


def quality() -> Figure:
    """Area explored over metres driven of two missions: quality is the slope of the line to the end."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3.8), layout="constrained")
    axes = figure.subplots()
    for strategy, colour in (("temporal", CARRIER), ("heuristic", ROVER)):
        result = _mission(strategy)
        axes.plot(*_driven_and_explored(result), color=colour, label=strategy)
        driven_m, explored_m2 = result.distance_m, result.explored_area_m2
        axes.plot([0, driven_m], [0, explored_m2], color=colour, linewidth=0.8, linestyle="--")
        axes.plot(driven_m, explored_m2, marker="o", color=colour)
        axes.annotate(
            f"{explored_m2:.0f} m² / {driven_m:.0f} m\nQ = {result.quality:.2f} m²/m",
            (driven_m, explored_m2),
            xytext=(0, 10),
            textcoords="offset points",
            ha="center",
            color=colour,
        )
    axes.set_xlim(0, 780)
    axes.set_ylim(0, 2300)
    axes.set_xlabel("driven by all robots [m]")
    axes.set_ylabel("explored of what can be reached [m²]")
    axes.set_title("Quality Q is the slope to the end of a mission (dashed)", loc="left")
    axes.legend(frameon=False, loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def first_robot() -> Figure:
    """Four moments of the mission of `first-robot.md`, with what is known by then."""
    from matplotlib.figure import Figure

    playback = Playback(marsupial.explore(_hall(), "temporal", "anytime", steps=20).events)
    ended = [event for event in playback.events if isinstance(event, ActionEnded)]
    down, up = (next(one.t_ms for one in ended if one.action.name == name) for name in ("undock", "dock"))
    seen = next(one.t_ms for one in ended if one.action.name == "explore" and one.t_ms > down)
    moments = {
        0: "joey is aboard mother, which sees the room",
        down: "mother has set joey down on the rubble",
        seen: "joey has seen the end of the way",
        up: "joey is aboard again, and nothing is left",
    }
    figure = Figure(figsize=(8, 2.9), layout="constrained")
    for axes, (t_ms, text) in zip(figure.subplots(2, 2).flat, moments.items(), strict=True):
        axes.imshow(ground_image(playback.cells_at(t_ms), LIGHT), origin="lower", interpolation="nearest")
        for robot in playback.robots_at(t_ms):
            role = Role.CARRIER if robot.type == "big" else Role.ROVER
            colour, size = (CARRIER, 17) if role is Role.CARRIER else (ROVER, 8)
            axes.plot(robot.x, robot.y, MARKERS[role], color=colour, markeredgecolor="black", markersize=size)
        axes.set_title(f"{t_ms / 1000:.0f} s: {text}", loc="left", fontsize=9)
        axes.set_axis_off()
    return figure


DRAWINGS: Mapping[str, Callable[[], Figure]] = {
    "step": step,
    "target": target,
    "meeting-point": meeting_point,
    "quality": quality,
    "first-robot": first_robot,
    "mission": lambda: _mission("temporal").plot(),
}


def draw(folder: Path) -> list[Path]:
    """Write all drawings and return where they are."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    with plain_style():
        from marsupial.exports.figures import figure_file

        for name, drawing in DRAWINGS.items():
            paths.append(folder / f"{name}.svg")
            paths[-1].write_bytes(figure_file(drawing(), "svg"))
    return paths


@cache
def _mission(strategy: str) -> Exploration:
    return marsupial.explore("office", strategy, "anytime", steps=20)


def _hall() -> Scenario:
    """The hall and the robots of `first-robot.md`."""
    wall, room, way = "#" * 17, "#......##########", "#........~~~~~~.#"
    cells = np.array([["#.~".index(one) for one in row] for row in (wall, room, way, room, wall)], dtype=np.uint8)
    any_robot = {"speed_mps": 1.0, "sensor_range_m": 1.5}
    big = RobotType(name="big", role=Role.CARRIER, radius_m=0.4, terrains=frozenset({1}), capacity=1, **any_robot)
    small = RobotType(
        name="small",
        role=Role.ROVER,
        radius_m=0.1,
        terrains=frozenset({1, 2}),
        dock_ms=2000,
        undock_ms=2000,
        **any_robot,
    )
    return Scenario(
        name="hall",
        grid=Grid(cells=cells, resolution_m=0.5),
        robot_types=(big, small),
        team=(
            TeamMember(name="mother", type="big", start=Cell(2, 2)),
            TeamMember(name="joey", type="small", carrier="mother"),
        ),
        goal=Goal(recover_rovers=True),
    )


def _moment() -> Moment:
    return moment_at(_mission("heuristic").events, 30_000)


def _makespan_s(situation: marsupial.Situation, planner: str, steps: int) -> float:
    *_, best = marsupial.plan(situation, planner, steps=steps)
    return best.makespan_ms / 1000


def _reach(moment: Moment) -> Mapping[str, Mask]:
    territory = Territory(moment.grid, moment.mission.types)
    return reach_of(territory, placed(moment.robots)).by_type


def _map_figure(grid: Grid) -> tuple[Figure, Axes]:
    """A drawing of the known part of a map; its axes count cells."""
    from matplotlib.figure import Figure

    known = np.argwhere(grid.cells != UNKNOWN)
    (low_y, low_x), (high_y, high_x) = known.min(axis=0) - 6, known.max(axis=0) + 7
    figure = Figure(figsize=(8, 8 * (high_y - low_y) / (high_x - low_x) + 0.8), layout="constrained")
    axes = figure.subplots()
    axes.imshow(ground_image(grid.cells, LIGHT), origin="lower", interpolation="nearest")
    axes.set_xlim(low_x, high_x)
    axes.set_ylim(low_y, high_y)
    axes.set_axis_off()
    bar = 5 / grid.resolution_m
    axes.plot([low_x + 2, low_x + 2 + bar], [low_y + 2] * 2, color="black", linewidth=3)
    axes.text(low_x + 2, low_y + 3, "5 m", fontsize=8)
    return figure, axes


def _shade(axes: Axes, where: Mask, colour: str) -> None:
    from matplotlib.colors import ListedColormap

    axes.imshow(np.ma.masked_equal(where.astype(float), 0), cmap=ListedColormap([colour]), origin="lower")


def _draw_robots(axes: Axes, moment: Moment) -> None:
    from matplotlib.patches import Circle

    radius = {kind.name: kind.radius_m / moment.grid.resolution_m for kind in moment.mission.types}
    for robot in moment.robots:
        if robot.cell is not None:
            x, y = _centre(robot.cell)
            axes.add_patch(Circle((x, y), max(1.2, radius[robot.type]), facecolor="black", zorder=5))
            axes.annotate(robot.name, (x, y), xytext=(5, -10), textcoords="offset points", fontsize=8, weight="bold")


def _centre(cell: Cell) -> tuple[float, float]:
    return float(cell.x), float(cell.y)


def _driven_and_explored(result: Exploration) -> tuple[Floats, list[float]]:
    """Metres driven by all robots and area explored (m2), at every half second of a mission."""
    playback = Playback(result.events)
    times_ms = range(0, playback.end_ms + 1, 500)
    driven_cells = np.zeros(len(times_ms))
    for drive in chain.from_iterable(drives(playback).values()):
        steps = np.hypot(*np.diff(drive.cells, axis=0).T)
        driven_cells += np.interp(times_ms, drive.times_ms, np.concatenate(([0.0], np.cumsum(steps))))
    area_m2 = playback.mission.resolution_m**2
    reachable = reachable_area(marsupial.scenario("office"), playback.mission.robots)
    explored = [area_m2 * np.count_nonzero(reachable & (playback.cells_at(t) != UNKNOWN)) for t in times_ms]
    return playback.mission.resolution_m * driven_cells, explored


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Draw the pictures of the concept pages and the gallery.")
    parser.add_argument("--to", type=Path, default=Path(__file__).parent / "pictures", help="folder")
    for path in draw(parser.parse_args().to):
        print(f"wrote {path}")
