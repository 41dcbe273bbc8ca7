from dataclasses import replace
from pathlib import Path

import pytest
from support.missions.faulty_mission import FAULTS, YARD
from support.missions.simulated_missions import STEP, drawn_scenario, team_at, watched
from support.missions.small_missions import Watcher
from support.missions.small_teams import ANNEX, CORRIDOR, kinds_of

import marsupial
from marsupial.bench.compare.plan import Case, Contender, Trial
from marsupial.bench.compare.trial import carry_out
from marsupial.cli.main import main
from marsupial.errors import ScenarioError
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model import Cell, Goal, MissionEnded, MissionLimits, Scenario, Status
from marsupial.strategies.clairvoyant import CLAIRVOYANT

LONG = ("#################", "#...............#", "#################")


def explore(scenario: Scenario, seed: int = 1) -> tuple[MissionEnded, Watcher]:
    ended, watcher = watched(scenario, CLAIRVOYANT, seed)
    assert watcher.faults == []
    return ended, watcher


@pytest.mark.parametrize(
    ("lines", "starts", "seconds"),
    [
        (CORRIDOR, [(4, 1)], 0),  # both ends are 3 cells away, which is how far a carrier sees
        (CORRIDOR, [(3, 1)], 1),
        (CORRIDOR, [(1, 1)], 3),
        (LONG, [(1, 1)], 11),
        (LONG, [(6, 1)], 10),  # 2 s to the near end, 8 s back to where the far one is in sight
        (LONG, [(6, 1), (7, 1)], 5),  # one end each
    ],
)
def test_halls_are_explored_in_the_time_it_takes_at_least(
    lines: tuple[str, ...], starts: list[tuple[int, int]], seconds: int
) -> None:
    ended, _ = explore(drawn_scenario(*lines, team=team_at(*starts)))
    assert (ended.status, ended.exploration_ms) == (Status.COMPLETE, 1000 * seconds)


@pytest.mark.parametrize(("start", "seconds"), [(4, 17), (1, 20)])
def test_a_rover_is_set_down_at_the_door_and_looks_at_the_near_end_first(start: int, seconds: int) -> None:
    # 5 s to set it down, 4 s to (3, 1), from where it sees the west end, 8 s to (7, 1)
    ended, _ = explore(drawn_scenario(*ANNEX, team=team_at((start, 3), rovers=1)))
    assert (ended.status, ended.exploration_ms) == (Status.COMPLETE, 1000 * seconds)
    assert (ended.deployments, ended.retrievals, len(ended.aboard)) == (1, 1, 1)


def test_two_rovers_share_what_is_behind_the_door() -> None:
    # the first is on the ground after 5 s and at (7, 1) 8 s later, the second after 10 s and at (3, 1) 4 s later
    ended, _ = explore(drawn_scenario(*ANNEX, team=team_at((4, 3), rovers=2)))
    assert (ended.exploration_ms, ended.deployments) == (14_000, 2)


def test_without_recovery_the_mission_ends_when_all_is_seen() -> None:
    ended, _ = explore(drawn_scenario(*ANNEX, team=team_at((4, 3), rovers=1), goal=Goal(recover_rovers=False)))
    assert (ended.status, ended.exploration_ms, ended.t_ms, ended.retrievals) == (Status.COMPLETE, 17_000, 17_000, 0)


def test_the_team_comes_home_if_asked_to() -> None:
    ended, watcher = explore(
        drawn_scenario(*ANNEX, team=team_at((1, 3), rovers=1), goal=Goal(recover_rovers=True, return_home=True))
    )
    assert (ended.status, len(ended.aboard)) == (Status.COMPLETE, 1)
    assert watcher.cell["c1"] == Cell(1, 3)


def test_unreachable_cells_are_left_out() -> None:
    ended, _ = explore(drawn_scenario("########", "#...#..#", "########", team=team_at((1, 1))))
    assert (ended.status, ended.coverage, ended.reachable_area_m2) == (Status.COMPLETE, 1.0, 3.0)


def test_a_time_limit_ends_the_mission_with_what_is_known_by_then() -> None:
    scenario = replace(drawn_scenario(*LONG, team=team_at((1, 1))), limits=MissionLimits(time_ms=5000))
    ended = explore(scenario)[0]
    assert (ended.status, ended.t_ms, ended.exploration_ms) == (Status.TIME_LIMIT, 5000, None)
    assert ended.coverage == pytest.approx(9 / 15)


def test_a_cancelled_mission_says_so() -> None:
    summary = simulate(
        drawn_scenario(*LONG, team=team_at((1, 1))),
        strategy=CLAIRVOYANT, planner="none", budget=STEP, seed=1, cancelled=lambda: True,
    )  # fmt: skip
    assert summary.status is Status.CANCELLED


@pytest.mark.parametrize("name", ["lobby", "rooms"])
def test_all_that_is_reachable_is_seen_on_built_in_maps_and_sooner_than_by_a_strategy(name: str) -> None:
    scenario = builtin_scenario(name)
    ended, _ = explore(scenario, seed=5)
    assert (ended.status, ended.coverage, ended.plans_invalid, len(ended.aboard)) == (Status.COMPLETE, 1.0, 0, 4)
    baseline = simulate(scenario, strategy="heuristic", planner="none", budget=STEP, seed=5)
    assert ended.exploration_ms is not None
    assert baseline.exploration_time_s is not None
    assert ended.exploration_ms < 1000 * baseline.exploration_time_s


def test_a_comparison_has_a_row_of_it_as_of_any_contender() -> None:
    scenario = builtin_scenario("lobby")
    result = carry_out(Trial(Case("lobby", 2, 2), Contender(CLAIRVOYANT), 1), scenario, STEP)
    row = result.row
    assert (row.complete, row.coverage, row.plans_refused) == (True, 1.0, 0)
    assert row.exploration_time_s is not None
    assert row.mission_time_s is not None
    assert 0 < row.exploration_time_s < row.mission_time_s
    assert result.curve.known[-1] == 10_000


def test_a_rover_can_go_back_to_where_it_was_set_down() -> None:
    """Another carrier's meeting point is nearer to where it ends, but that carrier is full."""
    scenario = replace(
        drawn_scenario(".,,..,", ".,.#.#", ".,..,#", "......", team=team_at((0, 0), (4, 3), rovers=2)),
        robot_types=tuple(kinds_of(capacity=2, carrier_range_m=0.5, rover_range_m=0.5).values()),
    )
    assert explore(scenario)[0].status is Status.COMPLETE


def test_what_it_does_not_reckon_with_is_refused_by_the_fields_that_ask_for_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = YARD.replace("undock_s: 5", "undock_s: 5, sensor_angle_deg: 90, battery: {capacity_j: 500}") + FAULTS
    path, out = tmp_path / "yard.yaml", tmp_path / "out"
    path.write_text(f"{text}zones: [{{name: a, kind: no_go, polygon_m: [[11, 4], [12, 4], [12, 5]]}}]\n")
    because = "clairvoyant plans the whole mission at its start, and does not reckon with"
    refused = [
        f"faults: {because} faults",
        f"zones: {because} zones",
        f"robot_types[1].battery: {because} batteries",
        f"robot_types[1].sensor_angle_deg: {because} sensor angles",
    ]
    with pytest.raises(ScenarioError) as error:
        marsupial.explore(path, CLAIRVOYANT, steps=1)
    assert [str(problem) for problem in error.value.problems] == refused
    assert main(["run", str(path), "--strategy", CLAIRVOYANT, "--steps", "1"]) == 3
    assert capsys.readouterr().err.splitlines()[-4:] == [f"error: {line}" for line in refused]
    assert main(["compare", str(path), "--strategies", f"{CLAIRVOYANT},heuristic", "--out", str(out)]) == 3
    assert capsys.readouterr().err.splitlines()[-4:] == [f"error: yard 2x2: {line}" for line in refused]
    assert not out.exists()
