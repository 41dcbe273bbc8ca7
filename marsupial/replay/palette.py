"""The colours of every picture of a mission: page, films, figures, terminal. Nothing else says what is of which colour.

A carrier has a hue, its rovers have shades of it and another shape; ground is grey, so that robots stand out; actions
are greys, from light (nothing to do) to dark (two robots at once), and yellow for what is explored: no robot is grey or
yellow. Hues differ in lightness as much as in hue, and were chosen by search so that they stay apart for readers who
see two primary colours only. Where there are more carriers than hues, hues begin again with dashed trails.

References
----------
G. M. Machado, M. M. Oliveira, L. A. F. Fernandes: A physiologically-based model for simulation of color vision
deficiency, IEEE TVCG 15(6), 2009: the simulation that the tests compute distances by.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN
from marsupial.model.mission import MissionStarted
from marsupial.model.robots import Role


@dataclass(frozen=True, slots=True, kw_only=True)
class Palette:
    """Colours as ``#rrggbb``.

    Attributes
    ----------
    families
        For each carrier in turn: its own colour, then those of its rovers in turn.
    page, ink, dim
        What is behind everything, text and outlines, text of less weight.
    unknown, free, wall, other
        Ground: unknown, floor, obstacles, any other terrain.
    frontier
        Where known ground ends, and targets; drawn with an outline of `ink`.
    actions
        By what a robot does: ``drive``, ``explore``, ``aboard`` (a carrier), ``dock``, ``undock``,
        ``wait``.
    """

    families: tuple[tuple[str, str, str, str], ...]
    page: str
    ink: str
    dim: str
    unknown: str
    free: str
    wall: str
    other: str
    frontier: str
    actions: Mapping[str, str]

    def ground(self, code: int) -> str:
        """Return the colour of cells with a terrain code."""
        return {UNKNOWN: self.unknown, OBSTACLE: self.wall, FLOOR: self.free}.get(code, self.other)

    def robot(self, look: RobotLook) -> str:
        """Return the colour of a robot."""
        return self.families[look.hue][look.shade]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotLook:
    """How a robot is told from others, whatever the palette.

    Attributes
    ----------
    role
        Gives the shape: no rover has that of a carrier.
    hue, shade
        Where its colour stands in `Palette.families`.
    dashed
        Whether another family has its colours already.
    """

    role: Role
    hue: int
    shade: int
    dashed: bool


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
    actions={
        "drive": "#9097a1",
        "explore": "#ffd60a",
        "aboard": "#c6cdd5",
        "dock": "#111418",
        "undock": "#5c636d",
        "wait": "#f4f5f7",
    },
)

REACH: Mapping[str, str] = {
    "carriers": "#8fbcff",
    "rovers": "#ffcf6e",
    "narrow": "#ffffff",
    "islands": "#9a6fb0",
    "leaks": "#d1322d",
}
"""Of a map before a mission, beside `LIGHT`: ground that carriers (and perhaps rovers) can stand on, that only rovers
can, that is too narrow for all, islands that are cut off from most of it, leaks at its border."""

DARK = Palette(
    families=(
        ("#6d92fe", "#abc3ff", "#e4f2ff", "#3b59c0"),
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
    actions={
        "drive": "#7d8590",
        "explore": "#ffe14d",
        "aboard": "#4a515c",
        "dock": "#ffffff",
        "undock": "#b9c0c9",
        "wait": "#23282f",
    },
)


ROVER_SHADES = 3
"""After so many the rovers of a carrier have their shades again, and only names tell them apart."""


def robot_looks(mission: MissionStarted) -> dict[str, RobotLook]:
    """Return how each robot looks, in the order of the team; a rover that starts on the ground has a hue of its own."""
    roles = {kind.name: kind.role for kind in mission.types}
    names = [robot.name for robot in mission.robots if robot.carrier is None]
    family = {name: number for number, name in enumerate(names)}
    aboard = dict.fromkeys(names, 0)
    looks: dict[str, RobotLook] = {}
    for robot in mission.robots:
        number, shade = family[robot.carrier or robot.name], 0
        if robot.carrier is not None:
            shade = aboard[robot.carrier] % ROVER_SHADES + 1
            aboard[robot.carrier] += 1
        hues = len(LIGHT.families)
        looks[robot.name] = RobotLook(role=roles[robot.type], hue=number % hues, shade=shade, dashed=number >= hues)
    return looks
