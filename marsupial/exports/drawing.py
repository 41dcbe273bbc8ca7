"""A mission drawn with matplotlib, at any moment: map, trails, robots and who is aboard; below, what each does when.

Figures and films are made of the same drawing: `MissionDrawing.show` moves it to a moment, and `frame` gives it as
pixels without drawing anew what stays.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from marsupial.exports.activity import Activity, activity, activity_text
from marsupial.exports.ground import box, coarse, ground_image
from marsupial.exports.lanes import draw_lanes
from marsupial.exports.trails import drives, handovers, trail
from marsupial.mission.playback import Playback
from marsupial.mission.state import RobotView, Track
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN
from marsupial.model.plan import ActionName
from marsupial.model.robots import Role
from marsupial.replay.palette import LIGHT, Palette, robot_looks
from marsupial.wording import clock

WIDTH_IN, HEIGHT_IN = 12.8, 7.2

MARKERS = {Role.CARRIER: "o", Role.ROVER: "D"}
SIZES_PT = {Role.CARRIER: 17.0, Role.ROVER: 8.0}
TRAILS_PT = {Role.CARRIER: 3.2, Role.ROVER: 1.3}

CARGO_PT, CARGO_RING_PT = 6.0, 9.5
"""Size of a rover aboard, and how far from its carrier's centre it is drawn: rovers aboard are a ring around it."""

MARGIN = 0.03
"""Around what is ever known, as a share of its longer side."""

PANEL = 0.215
"""Share of the width for the words beside the map."""

MOST_NAMED = 14
"""Rows of words beside the map have room for so many robots at full size."""

SCALE_BARS_M = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)

Pixels = npt.NDArray[np.uint8]

Look = dict[str, Any]
"""How a mark is drawn, as matplotlib calls it."""


class MissionDrawing:
    """One mission, drawn.

    Parameters
    ----------
    dpi
        Pixels in an inch, of `WIDTH_IN` x `HEIGHT_IN`; drawings for SVG need none.
    """

    def __init__(self, playback: Playback, *, palette: Palette = LIGHT, dpi: float = 100.0) -> None:
        self.playback, self.palette = playback, palette
        looks = robot_looks(playback.mission)
        self.roles = {name: look.role for name, look in looks.items()}
        self.colours = {name: palette.robot(look) for name, look in looks.items()}
        self._dashed = {name: look.dashed for name, look in looks.items()}
        self._drives, self._handovers = drives(playback), handovers(playback)
        self.figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=dpi, facecolor=palette.page)
        self._canvas = FigureCanvasAgg(self.figure)
        self._moving: list[Artist] = []
        self._still: Any = None
        self._lay_out()

    def _lay_out(self) -> None:
        count = len(self.roles)
        lanes = min(0.34, 0.05 + 0.024 * count)
        self._axes = self.figure.add_axes((0.012, lanes + 0.06, 1 - PANEL - 0.03, 0.925 - lanes))
        self._map()
        self._robots()
        self._panel()
        below = self.figure.add_axes((0.085, 0.055, 1 - PANEL - 0.103, lanes - 0.03))
        cover = draw_lanes(below, self.playback, self.palette, self.colours)
        self._cover = self._moves(cover)

    def _moves(self, artist: Any) -> Any:
        """Enter what `show` changes, in the order in which it is drawn."""
        artist.set_animated(True)
        self._moving.append(artist)
        return artist

    def _map(self) -> None:
        """Lay out the map so that all that is ever known is in it, and as much around as there is room."""
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
        wide_px = place.width * WIDTH_IN * self.figure.dpi
        self._block = max(1, math.ceil(across / wide_px))
        self._box = slice(bottom, top), slice(left, right)
        image = np.zeros((1, 1, 3), dtype=np.uint8)
        self._ground = self._moves(
            axes.imshow(image, origin="lower", interpolation="nearest", aspect="auto", zorder=0, resample=False)
        )
        self._scale_bar(axes, across * mission.resolution_m)

    def _scale_bar(self, axes: Axes, across_m: float) -> None:
        length_m = max((bar for bar in SCALE_BARS_M if bar <= across_m / 6), default=SCALE_BARS_M[0])
        share = length_m / across_m
        ink: Look = {"color": self.palette.ink, "transform": axes.transAxes}
        self._moves(axes.plot([0.012, 0.012 + share], [0.022, 0.022], linewidth=2.2, solid_capstyle="butt", **ink)[0])
        text = axes.text(0.012 + share / 2, 0.034, f"{length_m} m", ha="center", va="bottom", fontsize=8, **ink)
        self._moves(text)

    def _robots(self) -> None:
        """Prepare trails, marks where rovers were handed over, where robots go to, robots and the rovers aboard."""
        line = {name: self._line(name) for name in self.roles}
        self._trails = {name: self._moves(line[name]) for name in sorted(self.roles, key=self._above)}
        self._marks = {
            name: self._moves(self._axes.plot([], [], linestyle="", marker=mark, **self._mark(filled=filled))[0])
            for name, mark, filled in ((ActionName.UNDOCK, "v", True), (ActionName.DOCK, "^", False))
        }
        self._goals, self._bodies, self._cargo, self._names = {}, {}, {}, {}
        for name in self.roles:
            self._goals[name] = self._moves(self._goal(name))
        for name in sorted(self.roles, key=self._above):
            self._bodies[name] = self._moves(self._body(name, SIZES_PT[self.roles[name]], 1.4))
            if self.roles[name] is Role.CARRIER:
                look: Look = {"ha": "center", "va": "center", "fontsize": 7, "fontweight": "bold", "clip_on": True}
                self._names[name] = self._moves(self._axes.text(0, 0, "", color=self.palette.page, **look))
        for name, role in self.roles.items():
            if role is Role.ROVER:
                self._cargo[name] = self._moves(self._body(name, CARGO_PT, 0.9))

    def _above(self, name: str) -> bool:
        """Order what is drawn: rovers above carriers."""
        return self.roles[name] is Role.ROVER

    def _line(self, name: str) -> Line2D:
        role = self.roles[name]
        style = (0, (3, 1.5)) if self._dashed[name] else "-"
        alpha = 0.45 if role is Role.CARRIER else 0.9
        look: Look = {"linewidth": TRAILS_PT[role], "color": self.colours[name], "alpha": alpha, "linestyle": style}
        return self._axes.plot([], [], solid_capstyle="round", solid_joinstyle="round", **look)[0]

    def _goal(self, name: str) -> Line2D:
        """Return a line to where a robot drives, with a disc at its end."""
        look: Look = {"color": self.colours[name], "linewidth": 1.1, "linestyle": (0, (2, 2))}
        disc: Look = {"marker": "o", "markersize": 5, "markeredgecolor": self.palette.ink, "markevery": [1]}
        return self._axes.plot([], [], **look, **disc)[0]

    def _mark(self, *, filled: bool) -> Look:
        face = self.palette.ink if filled else self.palette.page
        return {"markersize": 5.5, "markeredgecolor": self.palette.ink, "markeredgewidth": 0.9, "markerfacecolor": face}

    def _body(self, name: str, size_pt: float, edge_pt: float) -> Line2D:
        look: Look = {"markersize": size_pt, "markeredgecolor": self.palette.page, "markeredgewidth": edge_pt}
        mark = MARKERS[self.roles[name]]
        return self._axes.plot([], [], linestyle="", marker=mark, color=self.colours[name], **look)[0]

    def _panel(self) -> None:
        """Prepare what stands beside the map: which mission, the clock, who does what."""
        mission, x = self.playback.mission, 1 - PANEL
        ink, dim = self.palette.ink, self.palette.dim
        self.figure.text(x, 0.955, shortened(mission.scenario, 24), fontsize=14, fontweight="bold", color=ink, va="top")
        self.figure.text(x, 0.915, f"{mission.strategy}, seed {mission.seed}", fontsize=9.5, color=dim, va="top")
        self._clock = self._moves(self.figure.text(x, 0.875, "", fontsize=21, color=ink, va="top"))
        self._known = self._moves(self.figure.text(x, 0.817, "", fontsize=9.5, color=dim, va="top"))
        step = min(0.033, 0.033 * MOST_NAMED / max(1, len(self.roles)))
        size = 9.5 * step / 0.033
        y, self._doing = 0.765, {}
        for name in self.family_order():
            indent = 0.012 * (self.roles[name] is Role.ROVER)
            mark: Look = {"marker": MARKERS[self.roles[name]], "color": self.colours[name], "linestyle": ""}
            small = 0.8 * size * (0.75 if indent else 1.1)
            self.figure.add_artist(Line2D([x + 0.006 + indent], [y], markersize=small, **mark))
            text: Look = {"fontsize": size, "va": "center_baseline"}
            self.figure.text(x + 0.018 + indent, y, shortened(name, 12), color=ink, **text)
            self._doing[name] = self._moves(self.figure.text(x + 0.1, y, "", color=dim, **text))
            y -= step
        self._key(x, min(y - 0.02, 0.3))

    def family_order(self) -> list[str]:
        """Return the robots, each carrier before the rovers that start on it."""
        home = {robot.name: robot.carrier or robot.name for robot in self.playback.mission.robots}
        order = {name: number for number, name in enumerate(home)}
        return sorted(home, key=lambda name: (order[home[name]], order[name]))

    def _key(self, x: float, y: float) -> None:
        """Say what the marks of the map mean."""
        square: Look = {"marker": "s", "markersize": 9, "markeredgecolor": self.palette.dim, "markeredgewidth": 0.6}
        grey = self.palette.actions["drive"]
        grounds = [(name, {**square, "color": getattr(self.palette, key)}) for name, key in GROUNDS]
        cells = self.playback.cells_at(self.playback.end_ms)
        others = [
            t for t in self.playback.mission.terrains if t.code not in (OBSTACLE, FLOOR) and (cells == t.code).any()
        ]
        if others:
            names = ", ".join(terrain.name for terrain in others)
            grounds.insert(2, (shortened(names, 14), {**square, "color": self.palette.other}))
        marks: list[tuple[str, Look]] = [
            ("carrier", {"marker": "o", "markersize": 11, "color": grey}),
            ("rover", {"marker": "D", "markersize": 6.5, "color": grey}),
            ("undocked", {"marker": "v", **self._mark(filled=True)}),
            ("docked", {"marker": "^", **self._mark(filled=False)}),
        ]
        for column, entries in enumerate((grounds, marks)):
            for row, (label, look) in enumerate(entries):
                at = x + 0.006 + 0.1 * column, y - 0.033 * row
                self.figure.add_artist(Line2D([at[0]], [at[1]], linestyle="", **look))
                self.figure.text(at[0] + 0.012, at[1], label, fontsize=9, color=self.palette.ink, va="center_baseline")

    def show(self, t_ms: int) -> None:
        """Bring the drawing to a moment."""
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
            marks.set_data([cell.x for cell in spots], [cell.y for cell in spots])
        robots, tracks = self.playback.state_at(t_ms).robots, self.playback.tracks_at(t_ms)
        for robot in robots:
            self._show_robot(robot, tracks[robot.name], {other.name: other for other in robots})
        known = self.playback.coverage_at(t_ms)
        self._clock.set_text(clock(t_ms / 1000))
        self._known.set_text(f"{known.open_m2:.0f} m² known")
        self._cover.set_x(t_ms / 60_000)
        self._cover.set_width(max(0.0, (self.playback.end_ms - t_ms) / 60_000))

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
        going = track.running is not None and activity(robot) in (Activity.DRIVE, Activity.EXPLORE) and not aboard
        goal = track.running.cell if going and track.running is not None else None
        self._goals[name].set_data(*([], []) if goal is None else ([robot.x, goal.x], [robot.y, goal.y]))
        face = self.palette.frontier if activity(robot) is Activity.EXPLORE else self.palette.page
        self._goals[name].set_markerfacecolor(face)
        self._doing[name].set_text(shortened(activity_text(robot), 21))

    def _berth(self, rover: RobotView, carrier: RobotView) -> tuple[float, float]:
        """Return where around its carrier a rover that is aboard is drawn."""
        number, count = carrier.cargo.index(rover.name), max(3, len(carrier.cargo))
        angle, ring = math.pi / 2 - 2 * math.pi * number / count, CARGO_RING_PT * self._cells_per_point
        return carrier.x + ring * math.cos(angle), carrier.y + ring * math.sin(angle)

    def still(self, t_ms: int) -> Figure:
        """Return the drawing at a moment as a figure to be saved; no frames can be had from it after that."""
        for artist in self._moving:
            artist.set_animated(False)
        self.show(t_ms)
        return self.figure

    def frame(self, t_ms: int) -> Pixels:
        """Return the drawing at a moment, (height, width, 3)."""
        if self._still is None:
            self._canvas.draw()
            self._still = self._canvas.copy_from_bbox(self.figure.bbox)
        self._canvas.restore_region(self._still)
        self.show(t_ms)
        for artist in self._moving:
            artist.axes.draw_artist(artist) if artist.axes is not None else self.figure.draw_artist(artist)
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


GROUNDS = (("unknown", "unknown"), ("floor", "free"), ("obstacle", "wall"), ("frontier", "frontier"))
"""What the key says of colours of the palette: the words of the page, in ``legend.js``."""


def shortened(text: str, most: int) -> str:
    """Return a text of at most so many letters."""
    return text if len(text) <= most else text[: most - 1] + "…"
