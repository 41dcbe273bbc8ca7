"""A mission as a drawing: what was explored of the map, every robot's trail, where rovers were set down and picked up.

A carrier has a colour, the rovers that start aboard it have shades of it.
"""

from __future__ import annotations

import io
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from marsupial.library.metrics import METRICS, Summary
from marsupial.mission.state import MissionTracker, Track
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, CellArray
from marsupial.model.mission import ActionEnd, ActionEnded, DriveEnded, MissionEvent, MissionStarted, RobotLost
from marsupial.model.plan import ActionName

COLOURS = ("#2f7de1", "#e0731d", "#23a074", "#a463d8", "#d2456b", "#8a8f20", "#1aa3b8", "#7a5c3e")

UNKNOWN_GROUND, WALL, FREE, OTHER = "#dfe3e8", "#3c444d", "#ffffff", "#f3ead3"
"""Colours of cells: never seen, obstacles, floor, any other terrain."""

TITLE = (("exploration_time_s", "mission_time_s"), ("coverage", "distance_m", "quality"))
"""The metrics in the title, line by line."""

WIDTH_IN, DPI = 9.0, 110

MOST_LEGEND_ROWS = 26

Colour = tuple[float, float, float]


class MissionFigure(Figure):
    """A figure that notebooks show whether pyplot is in use or not."""

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.savefig(data, format="png")
        return data.getvalue()


def mission_figure(events: Sequence[MissionEvent], summary: Summary) -> MissionFigure:
    """Return the drawing of a mission, apart from pyplot."""
    mission = events[0]
    assert isinstance(mission, MissionStarted)
    shape = mission.height / mission.width
    figure = MissionFigure(figsize=(WIDTH_IN, max(3.0, 0.8 * WIDTH_IN * shape + 0.9)), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    resolution = mission.resolution_m
    extent = (0.0, mission.width * resolution, 0.0, mission.height * resolution)
    traces = _traces(events)
    axes.imshow(_image(traces.cells), origin="lower", extent=extent)
    colours = _colours(mission)
    _draw_trails(axes, mission, traces, colours)
    _draw_meetings(axes, traces, colours, resolution)
    _draw_starts(axes, mission, colours)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(_title(summary), fontsize=10, loc="left")
    figure.legend(
        handles=[*_legend(mission, colours), *_grounds(mission, traces.cells)],
        loc="outside right upper",
        fontsize=8,
        frameon=False,
        ncols=1 + (len(colours) + 5) // MOST_LEGEND_ROWS,
    )
    return figure


def _title(summary: Summary) -> str:
    lines = (", ".join(f"{METRICS[key].title} {METRICS[key].shown(summary)}" for key in row) for row in TITLE)
    head = f"{summary.scenario}: {summary.strategy} ({summary.planner}), seed {summary.seed}: {summary.status}"
    return "\n".join([head, *lines])


def _image(cells: CellArray) -> npt.NDArray[np.float64]:
    """Return the colours of all cells, (height, width, 3)."""
    image = np.full((*cells.shape, 3), to_rgb(OTHER))
    for code, colour in ((UNKNOWN, UNKNOWN_GROUND), (OBSTACLE, WALL), (FLOOR, FREE)):
        image[cells == code] = to_rgb(colour)
    return image


def _colours(mission: MissionStarted) -> dict[str, Colour]:
    """Return a colour for each robot, in the order of the team."""
    colours: dict[str, Colour] = {}
    families = [robot.name for robot in mission.robots if robot.carrier is None]
    for i, name in enumerate(families):
        base = np.array(to_rgb(COLOURS[i % len(COLOURS)]))
        aboard = [robot.name for robot in mission.robots if robot.carrier == name]
        colours[name] = _rgb(base)
        for k, rover in enumerate(aboard, start=1):
            share = 0.6 * k / (len(aboard) + 1)
            colours[rover] = _rgb(base * (1 - share) + share * (k % 2))  # by turns towards white and black
    return {robot.name: colours[robot.name] for robot in mission.robots}


def _rgb(values: npt.NDArray[np.float64]) -> Colour:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


@dataclass(slots=True)
class _Traces:
    """What a mission leaves on the map.

    Attributes
    ----------
    trails
        Per robot: the cells of each of its drives, (cells, 2).
    handovers
        The docks and undocks that were carried out: which, the rover, and its cell on the ground.
    cells
        The known map at the end, (height, width).
    """

    trails: dict[str, list[npt.NDArray[np.float64]]]
    handovers: list[tuple[ActionName, str, Cell]]
    cells: CellArray


def _traces(events: Sequence[MissionEvent]) -> _Traces:
    state = MissionTracker()
    state.event(events[0])
    traces = _Traces({name: [] for name in state.tracks}, [], state.cells)
    for event in events[1:]:
        before = state.tracks
        state.event(event)
        if isinstance(event, DriveEnded | RobotLost):
            traces.trails[event.robot].append(_driven(before[event.robot], event.t_ms))
        elif isinstance(event, ActionEnded) and event.end is ActionEnd.DONE and event.action.carrier is not None:
            begun = before[event.action.robot].running
            if begun is not None:
                traces.handovers.append((event.action.name, event.action.robot, begun.cell))
    for name, track in state.tracks.items():
        if not track.lost:
            traces.trails[name].append(_driven(track, state.t_ms))
    return traces


def _driven(track: Track, t_ms: int) -> npt.NDArray[np.float64]:
    """Return the cells (n, 2) that a robot has passed by `t_ms` on the drive that it is on."""
    leg = track.where.at
    passed = () if leg is None else leg.cells[: bisect_right(leg.times_ms, t_ms)]
    return np.array(passed, dtype=np.float64).reshape(-1, 2)


def _draw_trails(axes: Axes, mission: MissionStarted, traces: _Traces, colours: Mapping[str, Colour]) -> None:
    gap = np.full((1, 2), np.nan)
    for robot, drives in traces.trails.items():
        if drives:
            points = np.concatenate([part for drive in drives for part in (drive, gap)])
            x, y = ((points + 0.5) * mission.resolution_m).T
            axes.plot(x, y, color=colours[robot], **_line(mission, robot))


def _line(mission: MissionStarted, robot: str) -> dict[str, Any]:
    """Return how a robot's trail is drawn: a carrier's broad, a rover's thin above it."""
    is_rover = any(one.name == robot and one.carrier is not None for one in mission.robots)
    return {"linewidth": 1.0 if is_rover else 2.2, "alpha": 0.95 if is_rover else 0.55, "solid_capstyle": "round"}


def _draw_meetings(axes: Axes, traces: _Traces, colours: Mapping[str, Colour], resolution_m: float) -> None:
    for name, rover, cell in traces.handovers:
        x, y = ((value + 0.5) * resolution_m for value in cell)
        filled = name is ActionName.UNDOCK
        axes.plot(x, y, "v" if filled else "^", markersize=5.5, markeredgewidth=1.1, markeredgecolor=colours[rover],
                  color=colours[rover] if filled else "white", zorder=4)  # fmt: skip


def _draw_starts(axes: Axes, mission: MissionStarted, colours: Mapping[str, Colour]) -> None:
    for robot in mission.robots:
        if robot.cell is not None:
            x, y = ((value + 0.5) * mission.resolution_m for value in robot.cell)
            axes.plot(x, y, "o", markersize=8, color=colours[robot.name], markeredgecolor="black", zorder=5)


def _legend(mission: MissionStarted, colours: Mapping[str, Colour]) -> list[Line2D]:
    robots = [Line2D([], [], color=colour, label=name, **_line(mission, name)) for name, colour in colours.items()]
    signs = (("o", "start", "#777777"), ("v", "set down", "#777777"), ("^", "picked up", "white"))
    return robots + [
        Line2D([], [], linestyle="", marker=mark, color=face, markeredgecolor="#555555", label=name)
        for mark, name, face in signs
    ]


def _grounds(mission: MissionStarted, cells: CellArray) -> Iterator[Patch]:
    """Yield what the colours of cells mean that need to be told."""
    names = [terrain.name for terrain in mission.terrains if terrain.code not in (UNKNOWN, OBSTACLE, FLOOR)]
    codes = [terrain.code for terrain in mission.terrains if terrain.name in names]
    if np.isin(cells, codes).any():
        yield Patch(facecolor=OTHER, edgecolor="#999999", label=", ".join(names))
    if (cells == UNKNOWN).any():
        yield Patch(facecolor=UNKNOWN_GROUND, edgecolor="#999999", label="unknown")
