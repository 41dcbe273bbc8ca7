import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from support.missions.synthetic_mission import mission_started, synthetic_mission

from marsupial.cli.display.picture import doing
from marsupial.cli.display.terminal_replay import play, summary_lines
from marsupial.exports.ground import coarse
from marsupial.formats.loglines import read_triggers
from marsupial.mission.playback import Playback
from marsupial.model import FLOOR, OBSTACLE, ROUGH, UNKNOWN, MissionEvent, Planned, RobotLost

EVENTS = synthetic_mission()


class Watch:
    """A clock that only `sleep` advances."""

    def __init__(self) -> None:
        self.now_s = 1_000.0
        self.naps: list[float] = []

    def clock(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.naps.append(seconds)
        self.now_s += seconds


def shown(events: Sequence[MissionEvent], *, terminal: bool, speed: float = 10.0) -> tuple[str, Watch]:
    watch = Watch()
    console = Console(
        file=io.StringIO(),
        force_terminal=terminal,
        color_system="truecolor" if terminal else None,
        width=80,
        height=24,
        _environ={},
    )
    play(events, console, speed, watch.clock, watch.sleep)
    return console.file.getvalue(), watch


def code_picture(*rows: str) -> np.ndarray:
    """Return cells from rows of characters, the uppermost first."""
    signs = {" ": UNKNOWN, "#": OBSTACLE, ".": FLOOR, ":": ROUGH}
    return np.array([[signs[sign] for sign in row] for row in reversed(rows)], dtype=np.uint8)


# Output without animation.


def test_without_a_terminal_each_plan_and_the_end_are_one_line() -> None:
    text, watch = shown(EVENTS, terminal=False)
    assert text.splitlines() == [
        "0:00  28.1 m2 known  plan 1: start; 3 actions, 1 target, 1 meeting point",
        "0:13  61.2 m2 known  plan 2: t1 gone; 3 actions, 1 target, 1 meeting point",
        "0:26  62.2 m2 known  stalled: 2 frontiers are left that nobody can reach; coverage 68.4 %, 2 frontiers left",
    ]
    assert watch.naps == []


def test_a_terminal_without_colours_gets_lines() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, no_color=True, width=80, _environ={})
    play(EVENTS, console, 1.0, Watch().clock, Watch().sleep)
    assert len(console.file.getvalue().splitlines()) == 3


def test_a_log_without_an_end_is_shown_as_such() -> None:
    assert summary_lines(Playback(EVENTS[:-1]))[-1].endswith("the log ends here, without a stop report")


def test_text_from_the_log_cannot_steer_the_terminal() -> None:
    plan = next(event for event in EVENTS if isinstance(event, Planned))
    text, _ = shown([mission_started(), replace(plan, trigger=read_triggers("\x1b[2J[red]\n"))], terminal=False)
    assert "plan 1: ?[2J[red]?;" in text


# On a terminal.


def test_the_screen_moves_until_the_mission_is_over() -> None:
    text, watch = shown(EVENTS, terminal=True)
    assert sum(watch.naps) == pytest.approx(2.6, abs=0.2)  # 26 s, ten times as fast
    assert "0:00" in text
    assert "0:26" in text
    assert "▀" in text


def test_a_screen_names_every_robot_and_what_it_does() -> None:
    text, _ = shown(EVENTS, terminal=True)
    for words in ("carrier1", "rover1_2", "explore t1", "dock on carrier1", "carries rover1_2", "plan 2: t1 gone"):
        assert words in text


def test_a_mission_that_knows_nothing_yet_can_be_shown() -> None:
    text, _ = shown([mission_started()], terminal=True)
    assert "0.0 m2 known" in text


@pytest.mark.parametrize(
    ("t_ms", "robot", "words"),
    [(0, "carrier1", "move m1"), (0, "rover1_1", "aboard carrier1"), (11_000, "rover1_1", "explore t1")],
)
def test_a_robot_s_action_is_described_in_words(t_ms: int, robot: str, words: str) -> None:
    assert words in [doing(view) for view in Playback(EVENTS).robots_at(t_ms) if view.name == robot]


def test_a_lost_robot_is_shown_as_lost() -> None:
    playback = Playback([mission_started(), RobotLost(t_ms=5, robot="rover1_2", reason="battery")])
    assert [doing(view) for view in playback.robots_at(5) if view.name == "rover1_2"] == ["lost"]


# The downscaled picture.


def test_a_block_is_what_most_of_its_known_cells_are_or_the_wall_that_crosses_it() -> None:
    assert np.array_equal(coarse(code_picture(".. :  ", ". ::  "), 2), code_picture(".: "))
    # on the left a wall, on the right a stray obstacle
    assert np.array_equal(coarse(code_picture("..#...", "..#...", "..#.#."), 3), code_picture("#."))
