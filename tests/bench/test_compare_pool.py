import os
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from support.processes.compare_workers import GREEDY, dies_of_seed_2, dies_once, lobby, never_begins, never_ends
from support.processes.process_tree import below_launcher
from support.waiting import wait_until

from marsupial.bench.compare.conduct import LocalPool
from marsupial.bench.compare.plan import Case, Comparison
from marsupial.bench.compare.trial import carry_out
from marsupial.errors import InternalError


def test_every_mission_has_one_result_whatever_the_order() -> None:
    comparison = lobby(runs=2)
    trials = list(comparison.trials())
    with closing(LocalPool(comparison, 2).results(trials)) as results:
        rows = {result.row.trial: result.row for result in results}
    assert rows.keys() == set(trials)
    for trial in trials:
        scenario = comparison.scenarios[trial.case]
        assert rows[trial] == carry_out(trial, scenario, comparison.budget).row


def test_a_mission_that_kills_its_worker_twice_has_a_crashed_row() -> None:
    comparison = lobby(runs=4, contenders=[GREEDY])
    pool = LocalPool(comparison, 2, dies_of_seed_2)
    rows = {result.row.trial.seed: result.row for result in pool.results(list(comparison.trials()))}
    assert {seed: row.status for seed, row in rows.items()} == {
        1: "complete", 2: "crashed", 3: "complete", 4: "complete"
    }  # fmt: skip
    assert rows[2].reason == "the worker process died 2 times: its process was ended by signal SIGKILL"


def test_a_mission_whose_worker_dies_once_is_begun_again(tmp_path: Path) -> None:
    comparison = lobby(runs=3, contenders=[GREEDY])
    ((case, scenario),) = comparison.scenarios.items()
    comparison = replace(comparison, scenarios={case: replace(scenario, name=str(tmp_path / "died"))})
    rows = [result.row for result in LocalPool(comparison, 1, dies_once).results(list(comparison.trials()))]
    assert [(row.trial.seed, row.status) for row in rows] == [(1, "complete"), (2, "complete"), (3, "complete")]
    assert (tmp_path / "died").exists()


def test_workers_that_never_begin_are_a_bug_and_not_a_mission_that_failed() -> None:
    comparison = lobby()
    with pytest.raises(InternalError, match="could not be started: its process ended with exit code 7"):
        list(LocalPool(comparison, 1, never_begins).results(list(comparison.trials())))


def test_closing_early_leaves_no_worker_behind() -> None:
    before = below_launcher()
    comparison = lobby(runs=3, contenders=[GREEDY])
    results = LocalPool(comparison, 2, never_ends).results(list(comparison.trials()))
    next(results)

    def both() -> list[psutil.Process]:
        started = [process for process in below_launcher() if process not in before]
        return [process for process in started if not process.children()] if len(started) == 4 else []

    workers = wait_until(both, "two workers, each with a supervisor")
    assert len(workers) == 2
    results.close()
    assert not any(worker.is_running() for worker in workers)


def test_the_environment_is_left_as_it_is() -> None:
    before = dict(os.environ)
    comparison = lobby(runs=1, contenders=[GREEDY])
    list(LocalPool(comparison, 1).results(list(comparison.trials())))
    assert dict(os.environ) == before


def test_a_mission_that_raises_an_exception_has_a_row_with_the_reason() -> None:
    comparison: Comparison = lobby(runs=1, contenders=[GREEDY])
    trial = next(comparison.trials())
    crowd = replace(comparison.scenarios[Case("lobby", 1, 1)], team=())
    row = carry_out(trial, replace(crowd, robot_types=()), comparison.budget).row
    assert row.status == "error"
    assert ": " in row.reason
    assert row.exploration_time_s is None
