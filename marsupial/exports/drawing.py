"""A mission drawn with matplotlib at any moment: map, trails, robots and who is aboard; below, a lane for each robot.

::

    ┌────────────────────────────┬──────────┐
    │ map: ground, trails,       │ scenario │
    │ handovers, goals, robots   │ clock    │
    │                            │ robots   │
    ├────────────────────────────┤ legend   │
    │ lanes: who does what when  │          │
    └────────────────────────────┴──────────┘

Figures and films use the same drawing. Drawing everything with matplotlib takes a good part of a second, too long for
each of hundreds of frames. So the artists that change with time are *animated*: matplotlib leaves them out of a full
draw. `frame` restores the pixels of one full draw, lets `show` update the animated artists, and draws only those.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from marsupial.exports.figures import figure_file
from marsupial.exports.ground import box, coarse, ground_image
from marsupial.exports.style import plain_style
from marsupial.exports.trails import Activity, activity, activity_text, drives, handovers, stretches, trail
from marsupial.mission.playback import Playback
from marsupial.mission.state import RobotView, Track
from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, ActionName, MissionEvent, Role
from marsupial.replay.palette import LIGHT, Palette, robot_styles
from marsupial.wording import clock

WIDTH_IN, HEIGHT_IN = 12.8, 7.2

MARKERS = {Role.CARRIER: "o", Role.ROVER: "D"}
SIZES_PT = {Role.CARRIER: 17.0, Role.ROVER: 8.0}
TRAILS_PT = {Role.CARRIER: 3.2, Role.ROVER: 1.3}

# Size of a rover aboard, and its distance from the carrier's centre: rovers aboard form a ring.
CARGO_PT, CARGO_RING_PT = 6.0, 9.5

MARGIN = 0.03  # margin around the ground known at the end, as a share of its longer side
PANEL = 0.215  # width of the panel beside the map, as a share of the figure's
MOST_NAMED = 14  # most robots whose rows in the panel have full size; more rows shrink
LANE = 0.72  # height of the bars in a lane, as a share of the lane's

SCALE_BARS_M = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)

Pixels = npt.NDArray[np.uint8]

Style = dict[str, Any]  # keyword arguments of matplotlib for a mark or text


class MissionFigure(Figure):
    """A figure that notebooks show without pyplot, in our style wherever it is drawn."""

    def draw(self, renderer: RendererBase) -> None:
        with plain_style():
            super().draw(renderer)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        with plain_style():
            super().savefig(*args, **kwargs)

    def _repr_png_(self) -> bytes:
        return figure_file(self, "png")


class MissionDrawing:
    """The drawing of one mission; `dpi` is pixels per inch of a figure of `WIDTH_IN` x `HEIGHT_IN`, ignored by SVG."""

    def __init__(self, playback: Playback, *, palette: Palette = LIGHT, dpi: float = 100.0) -> None:
        self.playback, self.palette = playback, palette
        styles = robot_styles(playback.mission)
        self.roles = {name: style.role for name, style in styles.items()}
        self.colours = {name: palette.robot(style) for name, style in styles.items()}
        self._dashed = {name: style.dashed for name, style in styles.items()}
        self._drives, self._handovers = drives(playback), handovers(playback)
        self.figure = MissionFigure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=dpi, facecolor=palette.page)
        self._canvas = FigureCanvasAgg(self.figure)
        self._animated: list[Artist] = []
        self._background: Any = None
        lanes = min(0.34, 0.05 + 0.024 * len(self.roles))
        self._axes = self.figure.add_axes((0.012, lanes + 0.06, 1 - PANEL - 0.03, 0.925 - lanes))
        self._add_map()
        self._add_robots()
        self._add_panel()
        below = self.figure.add_axes((0.085, 0.055, 1 - PANEL - 0.103, lanes - 0.03))
        self._veil = self._animate(_draw_lanes(below, self.playback, self.palette, self.colours))

    def _animate(self, artist: Any) -> Any:
        """Register an artist that `show` updates; `frame` draws them in the order of registration."""
        artist.set_animated(True)
        self._animated.append(artist)
        return artist

    def _add_map(self) -> None:
        """Lay out the map: all ground known at the end, and the surroundings that fit into the axes."""
        mission, axes = self.playback.mission, self._axes
        known = self.playback.cells_at(self.playback.end_ms) != UNKNOWN
        bottom, top, left, right = box(known)
        margin = MARGIN * max(top - bottom, right - left)
        across, up = right - left + 2 * margin, top - bottom + 2 * margin
        place = axes.get_position()
        ratio = place.width * WIDTH_IN / (place.height * HEIGHT_IN)
        across, up = max(across, up * ratio), max(up, across / ratio)
        x, y = (left + right) / 2, (bottom + top) / 2
        axes.set_xlim(x - across / 2, x + across / 2)
        axes.set_ylim(y - up / 2, y + up / 2)
        axes.set_facecolor(self.palette.unknown)
        axes.set_xticks([])
        axes.set_yticks([])
        axes.spines[:].set_visible(False)
        self._cells_per_point = across / (place.width * WIDTH_IN * 72)
        # Cells smaller than a pixel would be dropped, walls among them: blocks of cells are drawn as one instead.
        self._block = max(1, math.ceil(across / (place.width * WIDTH_IN * self.figure.dpi)))
        self._box = slice(bottom, top), slice(left, right)
        image = np.zeros((1, 1, 3), dtype=np.uint8)
        self._ground = self._animate(
            axes.imshow(image, origin="lower", interpolation="nearest", aspect="auto", zorder=0, resample=False)
        )
        self._scale_bar(axes, across * mission.resolution_m)

    def _scale_bar(self, axes: Axes, across_m: float) -> None:
        length_m = max((bar for bar in SCALE_BARS_M if bar <= across_m / 6), default=SCALE_BARS_M[0])
        share = length_m / across_m
        ink: Style = {"color": self.palette.ink, "transform": axes.transAxes}
        self._animate(axes.plot([0.012, 0.012 + share], [0.022, 0.022], linewidth=2.2, solid_capstyle="butt", **ink)[0])
        # beside the bar: above it the map may begin
        text = axes.text(0.02 + share, 0.022, f"{length_m} m", va="center_baseline", fontsize=8, **ink)
        self._animate(text)

    def _add_robots(self) -> None:
        """Add the artists of trails, handovers, goals, robots and rovers aboard; later ones cover earlier ones."""
        line = {name: self._line(name) for name in self.roles}
        self._trails = {name: self._animate(line[name]) for name in sorted(self.roles, key=self._is_rover)}
        self._marks = {
            name: self._animate(self._axes.plot([], [], linestyle="", marker=mark, **self._mark(filled=filled))[0])
            for name, mark, filled in ((ActionName.UNDOCK, "v", True), (ActionName.DOCK, "^", False))
        }
        self._bodies, self._cargo, self._names = {}, {}, {}
        self._goals = {name: self._animate(self._goal(name)) for name in self.roles}
        for name in sorted(self.roles, key=self._is_rover):  # carriers first: rovers are drawn above them
            self._bodies[name] = self._animate(self._body(name, SIZES_PT[self.roles[name]], 1.4))
            if self.roles[name] is Role.CARRIER:
                style: Style = {"ha": "center", "va": "center", "fontsize": 7, "fontweight": "bold", "clip_on": True}
                self._names[name] = self._animate(self._axes.text(0, 0, "", color=self.palette.page, **style))
        for name in filter(self._is_rover, self.roles):
            self._cargo[name] = self._animate(self._body(name, CARGO_PT, 0.9))

    def _is_rover(self, name: str) -> bool:
        return self.roles[name] is Role.ROVER

    def _line(self, name: str) -> Line2D:
        role = self.roles[name]
        dashes = (0, (3, 1.5)) if self._dashed[name] else "-"
        alpha = 0.45 if role is Role.CARRIER else 0.9
        style: Style = {"linewidth": TRAILS_PT[role], "color": self.colours[name], "alpha": alpha, "linestyle": dashes}
        return self._axes.plot([], [], solid_capstyle="round", solid_joinstyle="round", **style)[0]

    def _goal(self, name: str) -> Line2D:
        """Return a line from a robot to the cell it drives to, with a disc at its end."""
        style: Style = {"color": self.colours[name], "linewidth": 1.1, "linestyle": (0, (2, 2))}
        disc: Style = {"marker": "o", "markersize": 5, "markeredgecolor": self.palette.ink, "markevery": [1]}
        return self._axes.plot([], [], **style, **disc)[0]

    def _mark(self, *, filled: bool) -> Style:
        face = self.palette.ink if filled else self.palette.page
        return {"markersize": 5.5, "markeredgecolor": self.palette.ink, "markeredgewidth": 0.9, "markerfacecolor": face}

    def _body(self, name: str, size_pt: float, edge_pt: float) -> Line2D:
        style: Style = {"markersize": size_pt, "markeredgecolor": self.palette.page, "markeredgewidth": edge_pt}
        mark = MARKERS[self.roles[name]]
        return self._axes.plot([], [], linestyle="", marker=mark, color=self.colours[name], **style)[0]

    def _add_panel(self) -> None:
        mission, x = self.playback.mission, 1 - PANEL
        ink, dim = self.palette.ink, self.palette.dim
        self.figure.text(x, 0.955, shortened(mission.scenario, 24), fontsize=14, fontweight="bold", color=ink, va="top")
        self.figure.text(x, 0.915, f"{mission.strategy}, seed {mission.seed}", fontsize=9.5, color=dim, va="top")
        self._clock = self._animate(self.figure.text(x, 0.875, "", fontsize=21, color=ink, va="top"))
        self._known = self._animate(self.figure.text(x, 0.817, "", fontsize=9.5, color=dim, va="top"))
        step = min(0.033, 0.033 * MOST_NAMED / max(1, len(self.roles)))
        size = 9.5 * step / 0.033
        y, self._doing = 0.765, {}
        homes = [robot.carrier or robot.name for robot in mission.robots]
        names = [robot.name for robot in mission.robots]
        # each carrier before the rovers that start on it
        for name, _ in sorted(zip(names, homes, strict=True), key=lambda pair: names.index(pair[1])):
            indent = 0.012 * self._is_rover(name)
            mark: Style = {"marker": MARKERS[self.roles[name]], "color": self.colours[name], "linestyle": ""}
            small = 0.8 * size * (0.75 if indent else 1.1)
            self.figure.add_artist(Line2D([x + 0.006 + indent], [y], markersize=small, **mark))
            text: Style = {"fontsize": size, "va": "center_baseline"}
            self.figure.text(x + 0.018 + indent, y, shortened(name, 12), color=ink, **text)
            self._doing[name] = self._animate(self.figure.text(x + 0.1, y, "", color=dim, **text))
            y -= step
        self._add_legend(x, min(y - 0.02, 0.3))

    def _add_legend(self, x: float, y: float) -> None:
        square: Style = {"marker": "s", "markersize": 9, "markeredgecolor": self.palette.dim, "markeredgewidth": 0.6}
        grey = self.palette.actions["drive"]
        grounds = [(name, {**square, "color": getattr(self.palette, key)}) for name, key in GROUNDS]
        there = set(np.unique(self.playback.cells_at(self.playback.end_ms)).tolist()) - {OBSTACLE, FLOOR}
        if others := [terrain.name for terrain in self.playback.mission.terrains if terrain.code in there]:
            grounds.insert(2, (shortened(", ".join(others), 14), {**square, "color": self.palette.other}))
        marks: list[tuple[str, Style]] = [
            ("carrier", {"marker": "o", "markersize": 11, "color": grey}),
            ("rover", {"marker": "D", "markersize": 6.5, "color": grey}),
            ("undocked", {"marker": "v", **self._mark(filled=True)}),
            ("docked", {"marker": "^", **self._mark(filled=False)}),
        ]
        for column, entries in enumerate((grounds, marks)):
            for row, (label, style) in enumerate(entries):
                at = x + 0.006 + 0.1 * column, y - 0.033 * row
                self.figure.add_artist(Line2D([at[0]], [at[1]], linestyle="", **style))
                self.figure.text(at[0] + 0.012, at[1], label, fontsize=9, color=self.palette.ink, va="center_baseline")

    def show(self, t_ms: int) -> None:
        cells = self.playback.cells_at(t_ms)[self._box]
        picture = cells if self._block == 1 else coarse(cells, self._block)
        self._ground.set_data(ground_image(picture, self.palette))
        left, bottom = self._box[1].start - 0.5, self._box[0].start - 0.5
        height, width = (self._block * size for size in picture.shape)
        self._ground.set_extent((left, left + width, bottom, bottom + height))
        for name, line in self._trails.items():
            line.set_data(*trail(self._drives[name], t_ms).T)
        for action, marks in self._marks.items():
            spots = [place.cell for place in self._handovers if place.name is action and place.t_ms <= t_ms]
            marks.set_data(*np.array(spots, dtype=np.int64).reshape(-1, 2).T)
        robots, tracks = self.playback.robots_at(t_ms), self.playback.tracks_at(t_ms)
        for robot in robots:
            self._show_robot(robot, tracks[robot.name], {other.name: other for other in robots})
        known = self.playback.coverage_at(t_ms)
        self._clock.set_text(clock(t_ms / 1000))
        self._known.set_text(f"{known.open_m2:.0f} m² known")
        self._veil.set_x(t_ms / 60_000)
        self._veil.set_width(max(0.0, (self.playback.end_ms - t_ms) / 60_000))

    def _show_robot(self, robot: RobotView, track: Track, others: dict[str, RobotView]) -> None:
        name = robot.name
        aboard = robot.carrier is not None
        self._bodies[name].set_data(*([], []) if aboard else ([robot.x], [robot.y]))
        self._bodies[name].set_color(self.palette.dim if robot.lost else self.colours[name])
        if name in self._cargo:
            place = self._berth(robot, others[robot.carrier]) if robot.carrier is not None else None
            self._cargo[name].set_data(*([], []) if place is None else ([place[0]], [place[1]]))
        if name in self._names:
            carriers = [one for one, role in self.roles.items() if role is Role.CARRIER]
            self._names[name].set_text(str(carriers.index(name) + 1))
            self._names[name].set_position((robot.x, robot.y))
        is_driving = activity(robot) in (Activity.DRIVE, Activity.EXPLORE) and not aboard
        goal = track.running.cell if is_driving and track.running is not None else None
        self._goals[name].set_data(*([], []) if goal is None else ([robot.x, goal.x], [robot.y, goal.y]))
        face = self.palette.frontier if activity(robot) is Activity.EXPLORE else self.palette.page
        self._goals[name].set_markerfacecolor(face)
        self._doing[name].set_text(shortened(activity_text(robot), 21))

    def _berth(self, rover: RobotView, carrier: RobotView) -> tuple[float, float]:
        """Return the point on the ring around its carrier at which a rover aboard is drawn."""
        number, count = carrier.cargo.index(rover.name), max(3, len(carrier.cargo))
        angle, ring = math.pi / 2 - 2 * math.pi * number / count, CARGO_RING_PT * self._cells_per_point
        return carrier.x + ring * math.cos(angle), carrier.y + ring * math.sin(angle)

    def still(self, t_ms: int) -> MissionFigure:
        """Return the drawing at a moment as a figure to save; `frame` can't be called after that."""
        for artist in self._animated:
            artist.set_animated(False)
        self.show(t_ms)
        return self.figure

    def frame(self, t_ms: int) -> Pixels:
        """Return the pixels of the drawing at a moment, (height, width, 3)."""
        if self._background is None:
            self._canvas.draw()
            self._background = self._canvas.copy_from_bbox(self.figure.bbox)
        self._canvas.restore_region(self._background)
        self.show(t_ms)
        for artist in self._animated:
            artist.axes.draw_artist(artist) if artist.axes is not None else self.figure.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


GROUNDS = (("unknown", "unknown"), ("floor", "free"), ("obstacle", "wall"), ("frontier", "frontier"))
"""Labels of the legend with their colours of the palette; the page has the same words in ``draw/legend.js``."""


def mission_figure(
    events: Sequence[MissionEvent], *, at_ms: int | None = None, palette: Palette = LIGHT, dpi: float = 100.0
) -> MissionFigure:
    """Return the drawing of a mission at a moment, or its end."""
    playback = Playback(events)
    t_ms = playback.end_ms if at_ms is None else min(max(at_ms, playback.start_ms), playback.end_ms)
    return MissionDrawing(playback, palette=palette, dpi=dpi).still(t_ms)


def _draw_lanes(axes: Axes, playback: Playback, palette: Palette, colours: Mapping[str, str]) -> Rectangle:
    """Draw the lanes of a whole mission over minutes; return the rectangle that veils the time to come."""
    names = list(playback.timeline)
    start, end = playback.start_ms / 60_000, max(playback.end_ms, playback.start_ms + 1) / 60_000
    axes.set_xlim(start, end)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_facecolor(palette.page)
    for row, found in enumerate(stretches(playback).values()):
        for does, bars in found.items():
            if does is not Activity.WAIT:
                low = row - LANE / 2
                axes.broken_barh(bars, (low, LANE), facecolors=palette.actions[does], linewidth=0)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="x", length=0, labelsize=8.5, colors=palette.ink)
    axes.tick_params(axis="y", length=0, labelsize=min(8.5, 100 / max(1, len(names))), colors=palette.ink)
    for label, name in zip(axes.get_yticklabels(), names, strict=True):
        label.set_color(colours[name])
        label.set_fontweight("bold")
    axes.xaxis.set_major_formatter(lambda minutes, _: clock(60 * minutes))
    axes.spines[:].set_visible(False)
    shown = (does for does in Activity if does is not Activity.WAIT)
    handles = [Patch(facecolor=palette.actions[does], label=str(does)) for does in shown]
    axes.legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=len(handles), frameon=False,
        fontsize=8, labelcolor=palette.ink, handlelength=1.2, borderaxespad=0.2, columnspacing=1.2,
    )  # fmt: skip
    cover = Rectangle((start, -0.5), end - start, len(names), facecolor=palette.page, alpha=0.78, linewidth=0)
    axes.add_patch(cover)
    return cover


def shortened(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
