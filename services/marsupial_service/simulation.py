"""Our simulator driven through a service: `marsupial run --server`.

The client makes sure that no message is lost; this module carries out the mission's commands in the simulator, and
reports the results.
"""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import cast

from marsupial.errors import UsageError
from marsupial.formats.loglines import LogDecoder
from marsupial.library.metrics import Summary
from marsupial.library.missions import reachable_area
from marsupial.mission.observer import Observer
from marsupial.mission.placement import place_team
from marsupial.model.mission import MissionEnded
from marsupial.model.planning import Budget
from marsupial.model.scenario import Scenario
from marsupial.model.strategy import PlanningReport
from marsupial_client import Busy, Client, ClientError, Mission
from marsupial_client.mission_documents import Brief, News
from marsupial_service.missions.simulated import SimulatedTeam, mission_document, planning_of


def simulate_mission(
    client: Client,
    scenario: Scenario,
    *,
    strategy: str,
    planner: str,
    budget: Budget,
    seed: int,
    observer: Observer,
    stopping: Callable[[], AbstractContextManager[Callable[[], bool]]],
) -> Summary:
    """Run one mission in the simulator here, planned by a service; return its summary and close the client.

    `stopping` is entered once the service has the mission; what it yields says whether to cancel it. Raises UsageError
    if the service refuses or can't be reached any more, ScenarioError if the team can't be placed.
    """
    began = time.perf_counter()
    team = place_team(scenario, seed)
    area = reachable_area(scenario, team)
    observer.reachable(area)
    kinds = {kind.name: kind for kind in scenario.robot_types}
    robots = SimulatedTeam(scenario.grid, kinds, team, scenario.faults, scenario.limits.time_ms, seed)
    asked = mission_document(scenario, team, area, strategy=strategy, planner=planner, budget=budget, seed=seed)
    with client:
        try:
            mission = client.begin(cast(Brief, asked))
            with stopping() as cancelled:
                ended, reports = _drive(mission, robots, observer, cancelled)
        except Busy as error:
            raise UsageError(f"the service can't be reached: {error}") from error
        except ClientError as error:
            raise UsageError(str(error)) from error
    return Summary.of(
        scenario,
        strategy=strategy,
        planner=planner,
        seed=seed,
        ended=ended,
        reports=reports,
        analysis_s=None,
        wall_s=time.perf_counter() - began,
    )


def _drive(
    mission: Mission, team: SimulatedTeam, observer: Observer, cancelled: Callable[[], bool]
) -> tuple[MissionEnded, list[PlanningReport]]:
    """Carry out the mission's commands and report, until the mission ends."""
    ended: MissionEnded | None = None
    decoder = LogDecoder()
    reports: list[PlanningReport] = []
    over = False
    for event in mission.events():
        if event.type == "log":
            logged = decoder.event(event.data)
            observer.event(logged)
            ended = logged if isinstance(logged, MissionEnded) else ended
        elif event.type == "decision":
            reports.append(planning_of(event.data))
            observer.planned(reports[-1])
        elif event.type == "state":
            team.paused = event.data["state"] == "paused"
        elif event.type == "commands":
            report = team.answer(event.data)
            if cancelled() and not over:
                over = True
                mission.cancel()
            if report is not None and not over:
                over = mission.report(cast(News, report)) is None  # another client has ended it
        elif event.type == "end" and ended is None:
            raise UsageError(f"the service ended the mission: {event.data['reason']}")
    assert ended is not None
    return ended, reports
