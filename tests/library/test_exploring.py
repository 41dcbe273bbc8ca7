"""`marsupial.explore`: the same mission as `marsupial run`, and its result."""

import inspect
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from support.missions.simulated_missions import drawn_scenario
from support.missions.small_teams import ANNEX

import marsupial
from marsupial.cli.main import main
from marsupial.errors import EngineUnavailable, ScenarioError, UsageError
from marsupial.formats.missionlog import read_log
from marsupial.model import Objective, Situation
from marsupial.planning.greedy import Greedy, serve

QUICK: dict[str, Any] = {"planner": "greedy", "steps": 1}


@pytest.fixture(scope="module")
def lobby() -> marsupial.Exploration:
    return marsupial.explore("lobby", **QUICK)


def test_a_result_has_what_the_command_line_prints(
    capsys: pytest.CaptureFixture[str], lobby: marsupial.Exploration
) -> None:
    assert main(["run", "lobby", "--planner", "greedy", "--steps", "1", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    ours = json.loads(json.dumps(lobby.as_dict(), allow_nan=False))
    assert list(ours) == list(printed)
    for each in (ours, printed):
        del each["planning_s"], each["analysis_s"], each["wall_s"]
    assert ours == printed


def test_every_key_is_an_attribute(lobby: marsupial.Exploration) -> None:
    told = lobby.as_dict()
    assert all(hasattr(lobby, key) for key in told)
    assert (lobby.status, lobby.coverage, lobby.rovers, lobby.robots) == ("complete", 1.0, 2, 6)
    assert lobby.planning_s.median == told["planning_s"]["median"]
    assert lobby.log is None


@pytest.mark.parametrize("strategy", ["temporal", "heuristic", "clairvoyant"])
def test_the_log_is_that_of_the_command_line_byte_for_byte(tmp_path: Path, strategy: str) -> None:
    ours, theirs = tmp_path / "python.jsonl", tmp_path / "shell.jsonl"
    scenario = marsupial.scenario("lobby", carriers=1, rovers=1)
    result = marsupial.explore(scenario, strategy, seed=7, steps=2, log=ours)
    command = f"run lobby --strategy {strategy} --carriers 1 --rovers 1 --seed 7 --steps 2"
    assert main([*command.split(), "--log", str(theirs)]) == 0
    assert ours.read_bytes() == theirs.read_bytes()
    assert result.log == ours
    assert result.events == tuple(read_log(ours).events)


def test_own_strategies_and_engines_are_passed_as_objects() -> None:
    class Twice(Greedy):
        info = marsupial.EngineInfo(name="twice", deterministic_steps=True)
        asked = 0

        def solve(
            self, situation: Situation, budget: marsupial.Budget, *, objective: Objective | None = None,
            start: marsupial.Plan | None = None,
        ) -> Iterator[marsupial.Improved | marsupial.Finished]:  # fmt: skip
            self.asked += 1
            return super().solve(situation, budget)

    class Serving:
        name = "serving"

        def decide(self, briefing: marsupial.Briefing) -> marsupial.Decision:
            return marsupial.Decision(plan=serve(briefing.situation)[0])

    engine = Twice()
    scenario = drawn_scenario(*ANNEX)
    result = marsupial.explore(scenario, planner=engine, steps=1)
    assert (result.status, result.strategy, result.planner) == ("complete", "temporal", "twice")
    assert engine.asked > 0
    result = marsupial.explore(scenario, Serving(), steps=1)
    assert (result.status, result.strategy, result.planner) == ("complete", "serving", "none")


def test_an_invalid_plan_of_an_own_strategy_ends_the_mission() -> None:
    class Wishful:
        name = "wishful"

        def decide(self, briefing: marsupial.Briefing) -> marsupial.Decision:
            (target, *_) = briefing.situation.targets
            robot = briefing.situation.robots[0]
            jump = marsupial.Action(
                name=marsupial.ActionName.EXPLORE, start_ms=0, duration_ms=1, robot=robot.name,
                place=target.name, origin=robot.place,
            )  # fmt: skip
            return marsupial.Decision(plan=marsupial.Plan.of([jump]))

    result = marsupial.explore(drawn_scenario(*ANNEX), Wishful(), steps=1)
    assert result.status == "failed"
    assert "wishful made an invalid plan" in result.reason


class Nearsighted:
    """Sees the eight neighbouring cells, also through walls."""

    def visible(self, truth: marsupial.Grid, kind: marsupial.RobotType, cell: marsupial.Cell) -> npt.NDArray[np.int64]:
        height, width = truth.cells.shape
        x, y = np.meshgrid(np.arange(cell.x - 1, cell.x + 2), np.arange(cell.y - 1, cell.y + 2))
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        return (y * width + x)[inside]


def test_own_sensors_are_passed_as_objects() -> None:
    scenario = drawn_scenario(*ANNEX)
    exact = marsupial.explore(scenario, **QUICK)
    same = marsupial.explore(scenario, **QUICK, sensor=marsupial.FieldOfView())
    near = marsupial.explore(scenario, **QUICK, sensor=Nearsighted())
    assert exact.events == same.events
    assert (near.status, near.coverage) == ("complete", 1.0)
    assert near.distance_m > exact.distance_m


@pytest.mark.parametrize(
    ("seen", "message"),
    [([10**9], "one outside"), ([-1], "one outside"), ([[1]], "list of cells"), ([0.5], "list of cells")],
)
def test_a_sensor_that_sees_nonexistent_cells_is_refused(seen: list[Any], message: str) -> None:
    class Broken:
        def visible(self, *_: object) -> npt.NDArray[Any]:
            return np.array(seen)

    with pytest.raises(UsageError, match=message):
        marsupial.explore(drawn_scenario(*ANNEX), **QUICK, sensor=Broken())


def test_a_sensor_may_see_nothing() -> None:
    class Blind:
        def visible(self, *_: object) -> npt.NDArray[Any]:
            return np.array([])

    assert marsupial.explore(drawn_scenario(*ANNEX), **QUICK, sensor=Blind()).status == "complete"


def test_errors_are_raised_before_anything_is_written(tmp_path: Path) -> None:
    log = tmp_path / "mission.jsonl"
    asked: list[tuple[type[Exception], str, dict[str, Any]]] = [
        (ScenarioError, "did you mean 'lobby'", {"scenario": "loby"}),
        (UsageError, "unknown strategy", {"strategy": "none"}),
        (UsageError, "unknown planner", {"planner": "none"}),
        (UsageError, "not the class", {"strategy": Nearsighted}),
        (UsageError, "seed: must be 0 or more, got -1", {"seed": -1}),
        (UsageError, "either", {"budget": 1.0}),
        (UsageError, "exact field of view", {"strategy": "clairvoyant", "sensor": Nearsighted()}),
        (EngineUnavailable, "no executable", {"planner": "cmd:no-such {domain} {problem}", "steps": None}),
    ]
    for error, message, changed in asked:
        with pytest.raises(error, match=message):
            marsupial.explore(**{"scenario": "lobby", **QUICK, "log": log, **changed})
        assert not log.exists()


def test_notebooks_show_the_drawing(lobby: marsupial.Exploration) -> None:
    assert lobby.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_drawing_leaves_pyplot_alone() -> None:
    program = (
        "import marsupial, sys; marsupial.explore('lobby', 'heuristic', steps=1).plot();"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout + done.stderr == ""


def test_importing_marsupial_imports_nothing_heavy() -> None:
    program = (
        "import sys, marsupial; heavy = {'numpy', 'numba', 'matplotlib', 'scipy', 'typer'} & set(sys.modules);"
        "assert not heavy, heavy; print(marsupial.__version__)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == marsupial.__version__


def test_every_name_that_is_offered_is_there_and_documented() -> None:
    assert dir(marsupial) == sorted(marsupial.__all__)
    for name in marsupial.__all__:
        value = getattr(marsupial, name)
        assert not (inspect.isclass(value) or inspect.isfunction(value)) or value.__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = marsupial.nothing


def test_the_names_offered_are_those_that_type_checkers_see() -> None:
    source = Path(inspect.getfile(marsupial)).read_text(encoding="utf-8")
    shown = {name.strip() for line in source.splitlines() if line.startswith("    from marsupial")
             for name in line.partition(" import ")[2].split(",")}  # fmt: skip
    assert shown == {*marsupial.__all__} - {"__version__"}
