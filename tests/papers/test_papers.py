from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes.compare_workers import invented

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.plan import Comparison, Trial, header_of
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.rows import Curve
from marsupial.bench.compare.statements import Experiment, StatementVerdict
from marsupial.errors import UsageError
from marsupial.library.missions import simulate
from marsupial.model import FLOOR, OBSTACLE, Budget
from marsupial.papers import PAPERS, PARTS, experiment
from marsupial.papers.alkhawaldah import experiment as alkhawaldah
from marsupial.papers.alkhawaldah import triples, weights
from marsupial.papers.mei2006 import experiment as mei
from marsupial.papers.mei2006.paths import RoutePairs
from marsupial.papers.wurm2008 import experiment as wurm2008

HOLDS, _, FAILS, OPEN = StatementVerdict


def terms(runs: int = 2, maps: Path = Path("/nowhere")) -> dict[str, Any]:
    return {"runs": runs, "planner": "greedy", "budget": Budget(steps=1), "maps": maps}


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with small maps that have the names of the two offices."""
    folder = tmp_path_factory.mktemp("maps")
    for name in wurm2008.TEAMS:
        (folder / f"{name}.pgm").write_bytes(b"P5 80 40 255\n" + bytes([254]) * 80 * 40)
        (folder / f"{name}.yaml").write_text(
            f"image: {name}.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )
    return folder


def outcome(comparison: Comparison, time_s: Callable[[Trial], float], runs: int = 2) -> ComparisonOutcome:
    """Return an outcome in which every mission takes that long."""
    trials = [trial for trial in comparison.trials() if trial.seed <= runs]
    rows = (replace(invented(trial).row, exploration_time_s=time_s(trial)) for trial in trials)
    return ComparisonOutcome(header_of(comparison), tuple(rows))


def experiment_of(name: str) -> Experiment:
    found = experiment(name)
    assert found is not None
    return found


def written(found: ComparisonOutcome) -> dict[str, bytes]:
    return dict(documents(found, experiment(str(found.header["paper"]))))


def verdicts(name: str, found: ComparisonOutcome) -> list[StatementVerdict]:
    return [finding.verdict for finding in experiment_of(name).findings(found)]


def test_parts_of_an_experiment_are_not_listed_as_papers() -> None:
    assert tuple(PAPERS) == ("wurm2010", "wurm2008", "alkhawaldah", "mei")
    assert {part for name in PAPERS for part in experiment_of(name).parts.values()} < set(PARTS)


@pytest.mark.parametrize("name", [*PAPERS, *PARTS])
def test_an_experiment_without_data_leaves_every_statement_open(name: str, maps: Path) -> None:
    found = outcome(experiment_of(name).comparison(**terms(maps=maps)), lambda trial: 1.0, runs=0)
    assert set(verdicts(name, found)) == {OPEN}
    made = written(found)
    assert b"not enough data" in made["checklist.md"]


def test_where_the_maps_are_missing_the_error_says_where_to_get_them() -> None:
    with pytest.raises(UsageError, match=r"fr079\.yaml, cartesium\.yaml; .* in /nowhere; docs/comparisons\.md says"):
        wurm2008.EXPERIMENT.comparison(**terms())


def test_clutter_is_added_to_the_cartesium_alone_the_same_each_time(maps: Path) -> None:
    plain = wurm2008.EXPERIMENT.comparison(**terms(maps=maps)).scenarios
    cluttered = wurm2008.CLUTTER_EXPERIMENT.comparison(**terms(maps=maps))
    assert cluttered.paper == "wurm2008-clutter"
    for case, scenario in cluttered.scenarios.items():
        assert np.any(scenario.grid.cells == OBSTACLE) == (case.scenario == "cartesium")
    grid = next(scenario.grid for case, scenario in plain.items() if case.scenario == "cartesium")
    boxes = wurm2008.cluttered(grid).cells
    assert np.array_equal(boxes, wurm2008.cluttered(grid).cells)
    assert 60 <= np.count_nonzero(boxes != grid.cells) <= 60 * 8 * 8


SPEEDS = {"temporal": 60.0, "segmentation": 80.0, "closest-frontier": 100.0}


def of_office(trial: Trial) -> float:
    """Return a time that falls with the team's size, most for segments with 3 robots and in the Cartesium."""
    share = SPEEDS[trial.contender.strategy]
    if trial.contender.strategy == "segmentation":
        share += 3.0 * abs(trial.case.carriers - 3) - 10.0 * (trial.case.scenario == "cartesium")
    return share / trial.case.carriers + 0.01 * trial.seed


def test_segments_that_are_faster_everywhere_are_found_so(maps: Path) -> None:
    compared = wurm2008.EXPERIMENT.comparison(**terms(runs=5, maps=maps))
    found = outcome(compared, of_office, runs=5)
    assert verdicts("wurm2008", found) == [HOLDS, HOLDS, HOLDS, HOLDS, HOLDS]
    slower = outcome(compared, lambda trial: 200.0 - of_office(trial), runs=5)
    assert verdicts("wurm2008", slower)[0] is FAILS
    assert verdicts("wurm2008", slower)[4] is FAILS
    names = set(written(found))
    assert {"figures/figure-5.svg", "figures/times.png", "report.html"} <= names


def as_printed(trial: Trial) -> float:
    sheng, bidding = alkhawaldah.PRINTED[int(trial.case.scenario.split()[0])]
    return {"sheng": sheng, "bidding": bidding, "temporal": 110.0}[trial.contender.strategy] + 0.01 * trial.seed


def test_the_printed_numbers_of_table_2_confirm_what_the_paper_says_of_them() -> None:
    comparison = alkhawaldah.EXPERIMENT.comparison(**terms())
    found = outcome(comparison, as_printed)
    assert verdicts("alkhawaldah", found) == [HOLDS, HOLDS, HOLDS, HOLDS]
    (table,) = alkhawaldah.EXPERIMENT.tables(found)
    assert [cell.text for cell in table.rows[0][:4]] == ["0", "158.7", "158.7", "+0.0 %"]
    assert len(table.rows) == 8
    late = outcome(comparison, lambda trial: 300.0 - as_printed(trial) - trial.case.carriers)
    assert verdicts("alkhawaldah", late)[0] is FAILS
    assert verdicts("alkhawaldah", late)[3] is FAILS


def test_a_partner_is_an_obstacle_where_robots_keep_apart() -> None:
    world = replace(alkhawaldah.cell_world("world", 6, 6, 0, 2), interference=True)
    waits = []
    for seed in range(1, 6):
        summary = simulate(world, strategy="bidding", planner="none", budget=Budget(steps=1), seed=seed)
        assert summary.interference is not None
        waits.append(summary.interference.waits)
    assert sum(waits) > 0


def triple_of(trial: Trial) -> tuple[float, ...]:
    return tuple(float(part.split("=")[1]) for part in trial.contender.strategy.split("/")[1:])


def test_triples_of_weights_are_grouped_by_ratio_and_by_maximum() -> None:
    comparison = triples.EXPERIMENT.comparison(**terms(runs=1))
    assert len(list(comparison.trials())) == 2 * 5**3

    def time_s(trial: Trial) -> float:
        n, p, c = triple_of(trial)
        return 100.0 + n / c + p / c

    assert verdicts("alkhawaldah-triples", outcome(comparison, time_s, runs=1)) == [FAILS, HOLDS]
    by_sum = outcome(comparison, lambda trial: 100.0 + sum(triple_of(trial)), runs=1)
    assert verdicts("alkhawaldah-triples", by_sum) == [HOLDS, FAILS]


def weights_of(trial: Trial) -> tuple[float, float]:
    _, of_neighbours, of_partner = trial.contender.strategy.split("/")
    return float(of_neighbours.removeprefix("W_n=")), float(of_partner.removeprefix("W_p="))


def test_weights_near_the_line_that_are_best_are_found_so() -> None:
    comparison = weights.EXPERIMENT.comparison(**terms(runs=1))

    def time_s(trial: Trial) -> float:
        n, p = weights_of(trial)
        return 100.0 + 40 * abs(n - p) / (1 + n + p) + 10 * max(n + p - 6, 0) + 2 * max(1 - n - p, 0)

    found = outcome(comparison, time_s, runs=1)
    assert verdicts("alkhawaldah-weights", found) == [HOLDS, HOLDS, HOLDS]
    names = set(written(found))
    figures = {"figures/figures-3-to-7.svg", "figures/figures-3-to-7.png"}
    assert names == {"checklist.md", "tables.md", "report.html", *figures}
    far = outcome(comparison, lambda trial: 100.0 - max(weights_of(trial)) + min(weights_of(trial)), runs=1)
    assert verdicts("alkhawaldah-weights", far) == [FAILS, FAILS, FAILS]


def test_the_best_times_are_those_within_ten_per_cent_of_the_range() -> None:
    times = np.array([[100.0, 130.0], [131.0, 400.0], [np.nan, 200.0]])
    assert weights.best(times).tolist() == [[True, True], [False, False], [False, False]]


WAYS = {"temporal": 0.95, "orientation": 1.0, "widest-frontier": 1.0}


def ways_of(trial: Trial) -> tuple[float, float]:
    """Return the printed distance and energy of a mission; 5 % less than orientation's for temporal planning."""
    orientation, widest = mei.PRINTED[trial.case.scenario]
    distance, energy = widest if trial.contender == mei.WIDEST else orientation
    share = WAYS[trial.contender.strategy]
    return share * distance + 0.01 * trial.seed, share * energy + 0.01 * trial.seed


def driven(ways: Callable[[Trial], tuple[float, float]], monkeypatch: pytest.MonkeyPatch) -> ComparisonOutcome:
    """Return an outcome with these distances and energies, and crossing curves; routes are compared on one map."""
    pairs = RoutePairs(shortest=np.array([[100.0, 120.0]]), cheapest=np.array([[100.7, 110.0]]))
    monkeypatch.setattr(mei, "path_table", lambda *, cuts_corners: pairs)
    comparison = mei.EXPERIMENT.comparison(**terms())
    results = [(trial, ways(trial)) for trial in comparison.trials()]
    rows = tuple(replace(invented(t).row, distance_m=d, energy_j=e) for t, (d, e) in results)
    known = {"widest-frontier": (100, 6000, 8000, 9000, 10_000), "orientation": (100, 3000, 8500, 10_000)}
    curves = tuple(
        Curve(trial=t, every_s=5.0, known=known.get(t.contender.strategy, known["orientation"])) for t, _ in results
    )
    return ComparisonOutcome(header_of(comparison), rows, curves=curves)


def test_the_printed_ways_of_mei_confirm_what_the_paper_says_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    found = driven(ways_of, monkeypatch)
    assert verdicts("mei", found) == [HOLDS, HOLDS, HOLDS, HOLDS, HOLDS]
    explored, routes = mei.EXPERIMENT.tables(found)
    texts = [cell.text for cell in explored.rows[0]]
    assert texts[2:8] == ["710.8", "710.8", "1222.6", "1222.6", "+41.9 %", "+41.9 %"]
    assert len(explored.rows) == 6
    assert routes.rows[0][3].text == "+8.4 %"
    assert {"figures/figure-11.svg", "figures/figure-13.png"} <= set(written(found))


def test_missions_from_the_corner_start_where_there_is_floor() -> None:
    comparison = mei.CORNER_EXPERIMENT.comparison(**terms(runs=1))
    assert len(list(comparison.trials())) == 9
    for scenario in comparison.scenarios.values():
        (robot,) = scenario.team
        assert scenario.grid.cells[robot.start.y, robot.start.x] == FLOOR
        assert robot.start.x + 99 - robot.start.y <= 6


def test_an_orientation_that_is_no_better_is_found_so(monkeypatch: pytest.MonkeyPatch) -> None:
    found = driven(lambda trial: (1000.0 + trial.seed, 1100.0 + trial.seed), monkeypatch)
    assert verdicts("mei", found)[1:] == [FAILS, FAILS, HOLDS, FAILS]
