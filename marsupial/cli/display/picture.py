"""A moment of a mission as text: the map with its robots, and their actions.

Two cells of the picture share a character (an upper half block, in two colours). Each cell of the picture stands for
a square of map cells: a wall if a wall crosses it, else its most frequent class. Robots are letters, carriers capital
ones, in the colour of the carrier they started on.
"""

import math
from collections.abc import Sequence
from itertools import cycle, groupby
from string import ascii_lowercase, ascii_uppercase

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from marsupial.exports.ground import box, coarse
from marsupial.formats.loglines import trigger_text
from marsupial.mission.state import RobotView
from marsupial.model import UNKNOWN, ActionName, CellArray, Mask, MissionStarted, Planned, Role
from marsupial.replay.palette import LIGHT, robot_styles
from marsupial.wording import counted

_LINES_BESIDE_MAP = 4  # up to two lines about the mission, and room for the prompt


class Picture:
    """Draws the moments of a mission; cells of the mask `shown` (height, width) must be visible, all if it is empty."""

    def __init__(self, mission: MissionStarted, shown: Mask, console: Console) -> None:
        self._console = console
        self._box = box(shown)
        codes = (UNKNOWN, *(terrain.code for terrain in mission.terrains))
        self._colours = {code: LIGHT.ground(code) for code in codes}
        self._marks = _marks(mission)

    def map(self, cells: CellArray, robots: Sequence[RobotView]) -> Text:
        """Return the map, as large as fits the console."""
        bottom, top, left, right = self._box
        rows = max(3, self._console.height - len(robots) - _LINES_BESIDE_MAP)
        block = max(1, math.ceil((right - left) / self._console.width), math.ceil((top - bottom) / (2 * rows)))
        picture = coarse(cells[bottom:top, left:right], block)
        marks = {}
        for robot in sorted(robots, key=lambda robot: self._marks[robot.name][0].isupper()):  # carriers on top
            if robot.carrier is None:
                spot = (int((robot.y - bottom) // (2 * block)), int((robot.x - left) // block))
                marks[spot] = self._marks[robot.name]
        return self._picture_text(picture, marks)

    def team(self, robots: Sequence[RobotView]) -> Table:
        """Return a row for each robot: its letter, name, action and cargo."""
        table = Table.grid(padding=(0, 2))
        for robot in robots:
            mark, style = self._marks[robot.name]
            cargo = f"carries {', '.join(robot.cargo)}" if robot.cargo else ""
            words = (
                Text(printable(text), no_wrap=True, overflow="ellipsis") for text in (robot.name, doing(robot), cargo)
            )
            table.add_row(Text(f" {mark} ", style=style), *words)
        return table

    def _picture_text(self, picture: CellArray, marks: dict[tuple[int, int], tuple[str, str]]) -> Text:
        """Return the picture, top row first; a mark replaces the character below it."""
        if len(picture) % 2:
            picture = np.vstack([picture, np.full((1, picture.shape[1]), UNKNOWN, dtype=np.uint8)])
        lines = []
        for row in reversed(range(len(picture) // 2)):
            pairs = zip(picture[2 * row + 1], picture[2 * row], strict=True)
            letters = [
                marks.get((row, x), ("▀", f"{self._colours[int(upper)]} on {self._colours[int(lower)]}"))
                for x, (upper, lower) in enumerate(pairs)
            ]
            runs = groupby(letters, key=lambda mark: mark[1])  # characters of the same style
            parts = (("".join(letter for letter, _ in run), style) for style, run in runs)
            lines.append(Text.assemble(*parts, no_wrap=True))
        return Text("\n").join(lines)


def moves(console: Console) -> bool:
    """Return whether a console can show a picture that is redrawn."""
    return console.is_terminal and not console.is_dumb_terminal and not console.no_color


def doing(robot: RobotView) -> str:
    if robot.lost:
        return "lost"
    if robot.carrier is not None:
        return f"aboard {robot.carrier}"
    action = robot.action
    if action is None:
        return "waits"
    if action.carrier is None:
        return f"{action.name} {action.place}"
    if action.robot == robot.name:
        return f"{action.name} {'on' if action.name is ActionName.DOCK else 'from'} {action.carrier}"
    return f"{action.name} {action.robot}"


def plan_text(plan: Planned) -> str:
    return printable(f"plan {plan.revision}: {trigger_text(plan.trigger)}")


def plan_line(plan: Planned) -> str:
    """Return the number, the trigger and the size of a plan as text."""
    counts = ((plan.actions, "action"), (plan.targets, "target"), (plan.meetings, "meeting point"))
    return f"{plan_text(plan)}; {', '.join(counted(len(items), noun) for items, noun in counts)}"


def _marks(mission: MissionStarted) -> dict[str, tuple[str, str]]:
    """Return each robot's letter and style: capitals for carriers, the colour of the carrier for its rovers."""
    letters = {Role.CARRIER: cycle(ascii_uppercase), Role.ROVER: cycle(ascii_lowercase)}
    styles = robot_styles(mission).items()
    return {name: (next(letters[s.role]), f"bold white on {LIGHT.families[s.hue][0]}") for name, s in styles}


def printable(text: str) -> str:
    """Return `text` without terminal control characters."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
