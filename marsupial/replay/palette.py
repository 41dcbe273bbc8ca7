"""The colours of all pictures of a mission: page, films, figures, terminal. No other file chooses a colour.

Each carrier has a hue; its rovers have shades of that hue and another shape. Ground is grey, so that robots stand out.
Actions are greys, from light (idle) to dark (docking, with two robots), and yellow for exploring; no robot is grey or
yellow. The hues were found by a search that keeps them distinct for colour-blind readers, so they differ in lightness
too. With more carriers than hues, the hues repeat with dashed trails.

References: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes: A physiologically-based model for simulation of color
vision deficiency, IEEE TVCG 15(6), 2009: the simulation by which the tests measure distances between colours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from marsupial.model import FLOOR, OBSTACLE, UNKNOWN, MissionStarted, Role


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """Colours as ``#rrggbb``."""

    # a tuple for each carrier: its own colour, then the colours of its rovers
    families: tuple[tuple[str, str, str, str], ...]
    # page, ink, dim: background, text and outlines, minor text
    page: str
    ink: str
    dim: str
    # ground: unknown, floor, obstacles, any other terrain
    unknown: str
    free: str
    wall: str
    other: str
    frontier: str  # frontier cells and targets, with an outline of `ink`
    actions: Mapping[str, str]  # by activity: ``drive``, ``explore``, ``aboard``, ``dock``, ``undock``, ``wait``

    def ground(self, code: int) -> str:
        """Return the colour of cells with a terrain code."""
        return {UNKNOWN: self.unknown, OBSTACLE: self.wall, FLOOR: self.free}.get(code, self.other)

    def robot(self, style: RobotStyle) -> str:
        return self.families[style.hue][style.shade]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotStyle:
    """How a robot is drawn, in any palette."""

    role: Role  # chooses the shape
    # hue, shade: indices of its colour in `Palette.families`
    hue: int
    shade: int
    dashed: bool  # whether an earlier family has the same colours


def _by_activity(*colours: str) -> dict[str, str]:
    return dict(zip(("drive", "explore", "aboard", "dock", "undock", "wait"), colours, strict=True))


LIGHT = Palette(
    families=(
        ("#3a88fc", "#034aa5", "#9cc3fe", "#002357"),  # blue
        ("#c17a00", "#774a03", "#faaf52", "#392000"),  # ochre
        ("#035638", "#5ba07e", "#86cca8", "#367b5b"),  # green
        ("#79056f", "#d266c3", "#fe97ee", "#aa409d"),  # plum
        ("#6a3dd7", "#9073fb", "#bfb6fe", "#2b0169"),  # violet
        ("#e83c5d", "#a90a38", "#fd8f99", "#4e0014"),  # red
        ("#0b828d", "#035b63", "#49acb7", "#002d31"),  # teal
        ("#635d06", "#8c863b", "#c3be73", "#2b2800"),  # olive
    ),
    page="#ffffff",
    ink="#1b1f24",
    dim="#616b78",
    unknown="#d4d9e0",
    free="#ffffff",
    wall="#2f353d",
    other="#f2e8d5",
    frontier="#ffd60a",
    actions=_by_activity("#9097a1", "#ffd60a", "#c6cdd5", "#111418", "#5c636d", "#f4f5f7"),
)

REACH: Mapping[str, str] = {
    "carriers": "#8fbcff",
    "rovers": "#ffcf6e",
    "narrow": "#ffffff",
    "islands": "#9a6fb0",
    "leaks": "#d1322d",
}
"""Colours for a map without a mission, beside `LIGHT`: ground that carriers (and perhaps rovers) can stand on, that
only rovers can, that is too narrow for all; islands that are cut off; leaks at the border."""

DARK = Palette(
    families=(
        ("#6d92fe", "#abc3ff", "#6d7fb8", "#3b59c0"),
        ("#d65c06", "#ff8f57", "#fec1a5", "#a14200"),
        ("#abec9c", "#79b86a", "#559246", "#377428"),
        ("#b267a7", "#e192d4", "#fed6f7", "#8c4482"),
        ("#dbcfff", "#afa1d8", "#8b7cb1", "#68598c"),
        ("#f2828d", "#febec1", "#cb5f6b", "#a23a4a"),
        ("#0dc5be", "#149a94", "#a3fff8", "#08726e"),
        ("#ceb708", "#98870f", "#fff4b0", "#716405"),
    ),
    page="#14171b",
    ink="#e6e9ee",
    dim="#98a2b0",
    unknown="#15181c",
    free="#2f3640",
    wall="#9aa4b0",
    other="#473c29",
    frontier="#ffe14d",
    actions=_by_activity("#7d8590", "#ffe14d", "#4a515c", "#ffffff", "#b9c0c9", "#23282f"),
)

# Number of shades for the rovers of a carrier; they repeat after that, and only names tell these rovers apart.
ROVER_SHADES = 3


def robot_styles(mission: MissionStarted) -> dict[str, RobotStyle]:
    """Return the style of each robot, in team order; a rover that starts on the ground has a hue of its own."""
    roles = {kind.name: kind.role for kind in mission.types}
    names = [robot.name for robot in mission.robots if robot.carrier is None]
    family = {name: number for number, name in enumerate(names)}
    aboard = dict.fromkeys(names, 0)
    styles: dict[str, RobotStyle] = {}
    for robot in mission.robots:
        # Shade 0 is the carrier's own colour, or that of a rover that starts alone.
        number, shade = family[robot.carrier or robot.name], 0
        if robot.carrier is not None:
            shade = aboard[robot.carrier] % ROVER_SHADES + 1
            aboard[robot.carrier] += 1
        hues = len(LIGHT.families)
        styles[robot.name] = RobotStyle(role=roles[robot.type], hue=number % hues, shade=shade, dashed=number >= hues)
    return styles
