import io
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from support.missions.synthetic_mission import RESOLUTION_M, synthetic_mission, truth

from marsupial.cli.display import progress as module
from marsupial.cli.display.messages import Alive
from marsupial.cli.display.progress import progress
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import reachable_area
from marsupial.mission.placement import place_team
from marsupial.model import Grid, Outcome, Planned, PlanningReport


def watch_lobby(monkeypatch: pytest.MonkeyPatch, console: Console) -> None:
    """Show the synthetic mission on its own map, with the team of the lobby."""
    monkeypatch.setattr(module, "Console", lambda **_: console)
    monkeypatch.setattr(module, "FRAME_EVERY_S", 0.0)
    scenario = replace(builtin_scenario("lobby"), grid=Grid(cells=truth(), resolution_m=RESOLUTION_M))
    with progress() as observer:
        observer.reachable(reachable_area(scenario, place_team(scenario, 1)))
        for event in synthetic_mission():
            observer.event(event)


def test_a_terminal_shows_map_clock_coverage_and_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, color_system="truecolor", width=100, height=40, _environ={})
    watch_lobby(monkeypatch, console)
    text = file.getvalue()
    assert "preparing the mission" in text
    assert "▀" in text
    assert "% known" in text
    first = synthetic_mission()[0]
    assert all(robot.name in text for robot in first.robots)


def test_without_colours_nothing_moves(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    file = io.StringIO()
    watch_lobby(monkeypatch, Console(file=file, force_terminal=True, no_color=True, _environ={}))
    assert file.getvalue() == ""
    lines = capsys.readouterr().err.splitlines()
    assert "robots, seed" in lines[0]
    assert all("\x1b" not in line for line in lines)


def failed(outcome: Outcome, detail: str) -> PlanningReport:
    return PlanningReport(planner="cmd:x", outcome=outcome, wall_s=0.1, detail=detail)


@pytest.mark.parametrize("terminal", [False, True])
def test_a_failing_planner_is_reported_once_with_its_output(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = io.StringIO()
    console = Console(file=file, force_terminal=terminal, width=200, _environ={})
    monkeypatch.setattr(module, "Console", lambda **_: console)
    with progress() as observer:
        observer.planned(failed(Outcome.SATISFICING, "nobody can serve t1"))
        observer.planned(failed(Outcome.OPTIMAL, "cmd:x: optimal (there is nothing to do)"))
        observer.planned(failed(Outcome.NO_PLAN, "cmd:x: no_plan (saying: Unrecognised [switch] \x1b)"))
        observer.planned(failed(Outcome.CRASHED, "cmd:x: crashed"))
    told = file.getvalue() + capsys.readouterr().err
    assert told.count("the mission goes on without") == 1
    assert "cmd:x: no_plan (saying: Unrecognised [switch] ?); the mission goes on without (said once)" in told


def test_the_progress_of_a_mission_is_available_at_any_time() -> None:
    lines = module._Lines()
    lines.reachable(np.ones(truth().shape, dtype=np.bool_))
    with Alive(lines.now) as lines.alive:
        assert lines.now() == "preparing the mission ..."
        for event in synthetic_mission()[:20]:
            lines.event(event)
        assert re.fullmatch(r" +0:0\d +\d+%  1 plan so far, the last for \d+ targets?", lines.now())


def test_a_line_is_printed_each_minute_of_simulated_time_and_fewer_in_long_missions(
    capsys: pytest.CaptureFixture[str],
) -> None:
    started, *_ = synthetic_mission()
    (plan, *_) = (event for event in synthetic_mission() if isinstance(event, Planned))
    lines = module._Lines()
    lines.reachable(np.ones(truth().shape, dtype=np.bool_))
    with Alive(lines.now, first_s=3600) as lines.alive:
        lines.event(started)
        for seconds in range(0, 12 * 3600, 20):
            lines.event(replace(plan, t_ms=1000 * seconds, revision=seconds))
    _, *told = capsys.readouterr().err.splitlines()
    times = [line.split()[0] for line in told]
    assert times[:4] == ["0:00", "1:00", "2:00", "3:00"]
    assert times[59:63] == ["59:00", "1:00:00", "1:10:00", "1:20:00"]
    assert times[-3:] == ["9:50:00", "10:00:00", "11:00:00"]
    assert len(times) == 60 + 54 + 2


def test_an_event_after_a_long_while_makes_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    (plan, *_) = (event for event in synthetic_mission() if isinstance(event, Planned))
    lines = module._Lines()
    lines.reachable(np.ones(truth().shape, dtype=np.bool_))
    with Alive(lines.now, first_s=3600) as lines.alive:
        lines.event(synthetic_mission()[0])
        for seconds in (0, 1, 59, 725, 731, 779, 780):
            lines.event(replace(plan, t_ms=1000 * seconds))
    assert [line.split()[0] for line in capsys.readouterr().err.splitlines()[1:]] == ["0:00", "12:05", "13:00"]
