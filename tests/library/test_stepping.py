"""`marsupial.Mission`: a mission led by its caller, one plan at a time."""

from typing import Any

import numpy as np
import pytest

import marsupial
from marsupial.errors import UsageError
from marsupial.model import UNKNOWN, ActionName, Plan
from marsupial.planning.greedy import serve


class Served(marsupial.Strategy):
    """List scheduling, as a strategy."""

    name = "stepped"

    def decide(self, briefing: marsupial.Briefing) -> marsupial.Decision:
        return marsupial.Decision(plan=serve(briefing.situation)[0])


def led(mission: marsupial.Mission) -> marsupial.Exploration:
    """Lead a mission to its end by list scheduling."""
    while mission.briefing is not None:
        mission.step(serve(mission.briefing.situation)[0])
    assert mission.result is not None
    return mission.result


def test_a_mission_that_is_stepped_is_that_of_a_strategy_with_the_same_plans() -> None:
    mission = marsupial.Mission("lobby")
    mission.reset(seed=3)
    assert led(mission).events == mission.events == marsupial.explore("lobby", Served(), seed=3).events


def test_a_mission_can_be_reset_at_any_time() -> None:
    mission = marsupial.Mission("lobby")
    mission.reset(seed=1)
    first = led(mission)
    for _ in range(2):
        mission.reset(seed=1)
        assert mission.result is None
        mission.step(serve(mission.briefing.situation)[0])  # type: ignore[union-attr]
    assert led(mission).events == first.events


def test_observations_are_the_state_as_arrays() -> None:
    mission = marsupial.Mission("office")
    seen = mission.reset(seed=1)
    scenario, briefing = mission.scenario, mission.briefing
    assert briefing is not None
    team, targets = scenario.team, briefing.situation.targets
    assert (seen.t_s, seen.known.shape, seen.targets_m.shape) == (0.0, scenario.grid.cells.shape, (len(targets), 2))
    assert seen.carriers.tolist() == [-1, 0, 0, -1, 3, 3]
    known = seen.known != UNKNOWN
    assert known.any()
    assert (seen.known[known] == scenario.grid.cells[known]).all()
    for i, member in enumerate(team):
        x, y = (seen.robots_m[i] / scenario.grid.resolution_m).astype(int)
        assert known[y, x]
        by_itself = briefing.situation.robot_by_name[member.name].place is not None
        assert np.isfinite(seen.travel_s[i]).any() == by_itself
    # a target's name has its cell
    cells = [f"t_{int(x)}_{int(y)}" for x, y in seen.targets_m / scenario.grid.resolution_m]
    assert cells == [target.name for target in targets]
    led(mission)
    before = seen.known.copy()
    assert (seen.known == before).all(), "an observation does not change later"


def test_robots_are_sent_to_targets_by_name_and_rovers_are_carried() -> None:
    mission = marsupial.Mission("office")
    seen = mission.reset(seed=1)
    sent: set[tuple[str, ActionName]] = set()
    while mission.briefing is not None:
        situation = mission.briefing.situation
        rovers = [robot.name for robot in situation.robots if situation.type_of(robot.name).capacity == 0]
        plan = mission.plan_for(dict(zip(rovers, [t.name for t in situation.targets], strict=False)))
        sent |= {(action.robot, action.name) for action in plan.actions}
        seen = mission.step(plan if plan.actions else serve(situation)[0])
    assert mission.result is not None
    assert (mission.result.status, mission.result.plans_invalid) == ("complete", 0)
    assert {name for _, name in sent} >= {ActionName.UNDOCK, ActionName.EXPLORE}
    assert len(seen.targets_m) == 0


def test_a_plan_that_cannot_be_carried_out_ends_the_mission() -> None:
    mission = marsupial.Mission("lobby")
    mission.reset()
    mission.step(Plan(actions=()))
    assert mission.result is not None
    assert mission.result.status == "stalled"
    with pytest.raises(UsageError, match="the mission has ended"):
        mission.step(Plan(actions=()))


@pytest.mark.parametrize("plan", [{"nobody": "t_1_1"}, {"carrier1": "t_x"}, "carrier1", None])
def test_other_things_than_plans_are_refused(plan: Any) -> None:
    mission = marsupial.Mission("lobby")
    mission.reset()
    with pytest.raises(UsageError):
        mission.step(plan)
    assert mission.briefing is not None, "and nothing happened"


def test_a_mission_has_to_begin() -> None:
    with pytest.raises(UsageError, match="reset"):
        marsupial.Mission("lobby").step({})
    with pytest.raises(UsageError, match="seed"):
        marsupial.Mission("lobby").reset(-1)


def test_progress_is_called_with_each_event_while_the_mission_runs() -> None:
    told: list[object] = []
    result = marsupial.explore("lobby", planner="greedy", steps=1, progress=told.append)
    assert told == list(result.events)
    with pytest.raises(UsageError, match="progress"):
        marsupial.explore("lobby", progress="yes")  # type: ignore[arg-type]


def test_an_exception_of_progress_ends_the_mission() -> None:
    def stop(event: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        marsupial.explore("lobby", planner="greedy", steps=1, progress=stop)
