"""A mission played in the terminal: map, robots, clock and who does what, on one screen that moves.

Two cells of the picture share a character (an upper half block, in two colours). Each cell of the picture stands for
a square of map cells: a wall where a wall crosses it, else what most of it is. Where the output is no terminal, or
has no colours, nothing moves: every plan and the end are one line each, at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import groupby
from string import ascii_lowercase, ascii_uppercase

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from marsupial.mission.playback import FleetState, Playback, RobotView
from marsupial.model.grid import FLOOR, OBSTACLE, ROUGH, UNKNOWN, CellArray
from marsupial.model.mission import MissionEnded, MissionEvent, Planned
from marsupial.model.plan import ActionName
from marsupial.model.robots import Role

FRAME_S = 0.1
_COLOURS = {UNKNOWN: "#59616d", OBSTACLE: "#16181c", FLOOR: "#f2f3f5", ROUGH: "#eeb0aa"}
_OTHER_TERRAIN = "#c3b1e1"
_FAMILIES = ("#1d63c4", "#c4520f", "#7a35b8", "#1f7a45", "#b3245f", "#8a6a00", "#00707d", "#5a5f66")
_LINES_BESIDE_MAP = 4  # clock, plan, and room for the prompt


def play(
    events: Sequence[MissionEvent],
    console: Console,
    speed: float,
    clock: Callable[[], float],
    sleep: Callable[[float], None],
) -> None:
    """Play a mission at `speed` times its own pace.

    Parameters
    ----------
    clock, sleep
        Seconds that pass while one watches, and how to wait for some.
    """
    playback = Playback(events)
    if console.is_terminal and not console.is_dumb_terminal and not console.no_color:
        _animate(playback, console, speed, clock, sleep)
    else:
        for line in summary_lines(playback):
            console.print(Text(line), soft_wrap=True)


def summary_lines(playback: Playback) -> list[str]:
    """Return a line for each plan and one for the end."""
    lines = [
        f"{clock_text(plan.t_ms)}  {_known(playback, plan.t_ms)}  {_plan_text(plan)}; {_counted(plan)}"
        for plan in playback.plans
    ]
    return [*lines, f"{clock_text(playback.end_ms)}  {_known(playback, playback.end_ms)}  {_end_text(playback.ended)}"]


def clock_text(t_ms: int) -> str:
    """Return a time as h:mm:ss."""
    minutes, seconds = divmod(t_ms // 1000, 60)
    return f"{minutes // 60}:{minutes % 60:02}:{seconds:02}"


def _animate(
    playback: Playback, console: Console, speed: float, clock: Callable[[], float], sleep: Callable[[float], None]
) -> None:
    screen = _Screen(playback, console)
    begin = clock()
    with Live(console=console, auto_refresh=False) as live:
        while True:
            t_ms = playback.start_ms + round((clock() - begin) * 1000 * speed)
            live.update(screen.frame(min(t_ms, playback.end_ms)), refresh=True)
            if t_ms >= playback.end_ms:
                return
            sleep(FRAME_S)


class _Screen:
    """Draws the moments of one mission for one console."""

    def __init__(self, playback: Playback, console: Console) -> None:
        self._playback = playback
        self._console = console
        mission = playback.mission
        self._known_box = _box(playback.cells_at(playback.end_ms))
        self._colours = {terrain.code: _COLOURS.get(terrain.code, _OTHER_TERRAIN) for terrain in mission.terrains}
        self._colours[UNKNOWN] = _COLOURS[UNKNOWN]
        self._marks = _marks(playback)

    def frame(self, t_ms: int) -> Group:
        """Return what the screen shows at `t_ms`."""
        state = self._playback.state_at(t_ms)
        return Group(self._map(state), self._headline(t_ms), self._team(state))

    def _map(self, state: FleetState) -> Text:
        bottom, top, left, right = self._known_box
        rows = max(3, self._console.height - len(state.robots) - _LINES_BESIDE_MAP)
        block = max(1, math.ceil((right - left) / self._console.width), math.ceil((top - bottom) / (2 * rows)))
        picture = coarse(self._playback.cells_at(state.t_ms)[bottom:top, left:right], block)
        marks = {}
        for robot in sorted(state.robots, key=lambda robot: self._marks[robot.name][0].isupper()):  # carriers on top
            if robot.carrier is None:
                spot = (int((robot.y - bottom) // (2 * block)), int((robot.x - left) // block))
                marks[spot] = self._marks[robot.name]
        return self._picture_text(picture, marks)

    def _picture_text(self, picture: CellArray, marks: dict[tuple[int, int], tuple[str, str]]) -> Text:
        """Return the picture, its uppermost rows first; a mark replaces the character it stands on."""
        if len(picture) % 2:
            picture = np.vstack([picture, np.full((1, picture.shape[1]), UNKNOWN, dtype=np.uint8)])
        lines = []
        for row in reversed(range(len(picture) // 2)):
            pairs = zip(picture[2 * row + 1], picture[2 * row], strict=True)
            letters = [
                marks.get((row, x), ("▀", f"{self._colours[int(upper)]} on {self._colours[int(lower)]}"))
                for x, (upper, lower) in enumerate(pairs)
            ]
            runs = [
                (style, "".join(letter for letter, _ in run)) for style, run in groupby(letters, key=lambda m: m[1])
            ]
            lines.append(Text.assemble(*((text, style) for style, text in runs), no_wrap=True))
        return Text("\n").join(lines)

    def _headline(self, t_ms: int) -> Text:
        plan = self._playback.plan_at(t_ms)
        over = t_ms >= self._playback.end_ms
        news = _end_text(self._playback.ended) if over else _plan_text(plan) if plan else "no plan yet"
        line = Text(no_wrap=True, overflow="ellipsis")
        line.append(clock_text(t_ms), style="bold")
        line.append(f"  {_known(self._playback, t_ms)}  {news}")
        return line

    def _team(self, state: FleetState) -> Table:
        table = Table.grid(padding=(0, 2))
        for robot in state.robots:
            mark, style = self._marks[robot.name]
            cargo = f"carries {', '.join(robot.cargo)}" if robot.cargo else ""
            table.add_row(Text(f" {mark} ", style=style), *map(_cell, (robot.name, doing(robot), cargo)))
        return table


def coarse(cells: CellArray, block: int) -> CellArray:
    """Return the picture of `cells` with one cell for each `block` x `block` of them.

    A picture cell is an obstacle where obstacles would cross it from side to side, unknown where nothing in it is
    known, and else the commonest of what is known in it.
    """
    height, width = cells.shape
    padded = np.pad(cells, ((0, -height % block), (0, -width % block)), constant_values=UNKNOWN)
    squares = padded.reshape(padded.shape[0] // block, block, padded.shape[1] // block, block)
    codes = [int(code) for code in np.unique(cells) if code not in (UNKNOWN, OBSTACLE)]
    counts = np.stack([np.count_nonzero(squares == code, axis=(1, 3)) for code in [OBSTACLE, *codes]])
    ground = np.array([*codes, UNKNOWN], dtype=np.uint8)[np.argmax(counts[1:], axis=0) if codes else 0]
    picture = np.where(counts.sum(axis=0) == 0, UNKNOWN, ground)
    walls = (counts[0] >= block) | ((counts[0] > 0) & (counts[1:].sum(axis=0) == 0))
    return np.where(walls, OBSTACLE, picture).astype(np.uint8)


def doing(robot: RobotView) -> str:
    """Say what a robot does."""
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


def _marks(playback: Playback) -> dict[str, tuple[str, str]]:
    """Return each robot's letter and style: capitals for carriers, the colour of the carrier for its rovers."""
    mission = playback.mission
    carrying = {kind.name for kind in mission.types if kind.role is Role.CARRIER}
    carriers = [robot.name for robot in mission.robots if robot.type in carrying]
    rovers = [robot.name for robot in mission.robots if robot.type not in carrying]
    marks = {}
    for robot in mission.robots:
        lead = robot.name in carriers
        letters, among = (ascii_uppercase, carriers) if lead else (ascii_lowercase, rovers)
        family = carriers.index(robot.carrier) if robot.carrier in carriers else among.index(robot.name)
        colour = _FAMILIES[family % len(_FAMILIES)]
        marks[robot.name] = (letters[among.index(robot.name) % 26], f"bold white on {colour}")
    return marks


def _box(cells: CellArray) -> tuple[int, int, int, int]:
    """Return bottom, top, left and right of what is known, upper bounds exclusive; all of it where nothing is."""
    known = cells != UNKNOWN
    rows, columns = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    if not rows.size:
        return 0, cells.shape[0], 0, cells.shape[1]
    return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1


def _cell(text: str) -> Text:
    return Text(_printable(text), no_wrap=True, overflow="ellipsis")


def _printable(text: str) -> str:
    """Return `text` without what would steer the terminal."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _known(playback: Playback, t_ms: int) -> str:
    return f"{playback.coverage_at(t_ms).open_m2:.1f} m2 known"


def _plan_text(plan: Planned) -> str:
    return _printable(f"plan {plan.revision}: {plan.trigger}")


def _counted(plan: Planned) -> str:
    counts = ((len(plan.actions), "action"), (len(plan.targets), "target"), (len(plan.meetings), "meeting point"))
    return ", ".join(f"{n} {word}{'' if n == 1 else 's'}" for n, word in counts)


def _end_text(ended: MissionEnded | None) -> str:
    if ended is None:
        return "the log ends here, without a stop report"
    left = f", {len(ended.remaining)} frontiers left" if ended.remaining else ""
    return _printable(f"{ended.status}: {ended.reason}; coverage {100 * ended.coverage:.1f} %{left}")
