from __future__ import annotations

import json
from dataclasses import replace

import pytest

from marsupial.bench import sim
from marsupial.bench.reference.compiled import NotCompiled, compiled
from marsupial.bench.sim import MissionRow, SightRow, bench_mission, bench_sight, table, values
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.missions import simulate
from marsupial.model.planning import Budget

STEPS = Budget(steps=2)
PLAIN = not isinstance(compiled("sight"), NotCompiled)


@pytest.fixture(scope="module")
def sight() -> SightRow:
    (row,) = bench_sight(sizes=(256,), repeats=1, views=5)
    return row


@pytest.fixture(scope="module")
def mission() -> MissionRow:
    return bench_mission(builtin_scenario("lobby"), "temporal", "greedy", STEPS)


def test_views_are_the_same_in_c(sight: SightRow) -> None:
    assert sight.same
    assert (sight.views, sight.size) == (5, 256)
    assert sight.cells > 5
    assert (sight.reference_s is not None) == PLAIN


def test_a_mission_is_the_one_that_is_simulated_without_the_bench(mission: MissionRow) -> None:
    seen = sim._Reveals()
    plain = simulate(
        builtin_scenario("lobby"), strategy="temporal", planner="greedy", budget=STEPS, seed=1, observer=seen
    )
    assert (mission.simulated_s, mission.replans) == (plain.mission_time_s, plain.replans)
    assert (mission.revealed, mission.reveals) == (seen.cells, seen.count)
    assert mission.status == "complete"
    assert plain.reachable_area_m2 < mission.revealed * builtin_scenario("lobby").grid.cell_area_m2


def test_the_time_of_a_mission_is_told_by_part(mission: MissionRow) -> None:
    assert sum(mission.parts.values()) == pytest.approx(mission.cpu_s)
    assert [*mission.parts] == [
        "sensing and driving", "analysis", "planning", "checking", "following plans", "log", "other",
    ]  # fmt: skip
    assert mission.ratio == pytest.approx(mission.simulated_s / mission.cpu_s)


def test_strategies_that_ask_no_planner_are_told_so() -> None:
    row = bench_mission(builtin_scenario("lobby"), "heuristic", "greedy", STEPS)
    assert (row.strategy, row.planner) == ("heuristic", "none")


def test_the_table_has_a_line_for_each_view_and_three_for_each_mission(sight: SightRow, mission: MissionRow) -> None:
    lines = table([sight, replace(sight, same=False, reference_s=1.0), replace(sight, reference_s=None)], [mission])
    views, missions = lines.split("\n\n")
    assert "see DIFFERENT cells" in views.splitlines()[4]
    assert views.splitlines()[5].endswith("-")
    assert len(missions.splitlines()) == 5
    assert max(len(line) for line in lines.splitlines() if "other" not in line) <= 100
    assert "lobby" in missions
    assert "analysis " in missions.splitlines()[-2]
    assert "cells a ms of sensing" in missions.splitlines()[-1]


def test_rows_say_of_what_kind_they_are_in_json(sight: SightRow, mission: MissionRow) -> None:
    rows = json.loads(json.dumps(values([sight], [mission])))
    assert [row["kind"] for row in rows] == ["sight", "mission"]
    assert rows[1]["parts"] == pytest.approx(mission.parts)
    assert rows[1]["revealed_per_s"] == pytest.approx(mission.revealed_per_s)
