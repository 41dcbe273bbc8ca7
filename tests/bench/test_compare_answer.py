import re
from dataclasses import replace
from pathlib import Path

from compare_outcomes import CASE, outcome_of, with_times
from support.pictures.colour_vision import contrast, nearest
from support.processes.compare_workers import GREEDY, HEURISTIC, invented, lobby

from marsupial.bench.compare.answer import sentence
from marsupial.bench.compare.cells import QUALITY
from marsupial.bench.compare.figures import COLOURS
from marsupial.bench.compare.pairs import notable_pairs, replays_in
from marsupial.bench.compare.plan import Contender
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.tables import main_table, markdown, winners_table


def sections(text: str) -> list[str]:
    return re.findall(r"<h2>(.*?)</h2>", text)


def test_the_page_begins_with_the_answer_then_who_wins_where_and_one_plot() -> None:
    text = dict(documents(outcome_of(lobby(runs=5))))["report.html"].decode()
    assert sections(text) == ["The answer", "lobby", "In numbers", "Method"]
    opening = text[: text.index("<h2>lobby</h2>")]
    assert (
        "temporal (greedy) explores in 8.9 % less time than heuristic on average over 5 pairs of missions on lobby"
        in opening
    )
    assert "it needs less in 5 and more in 0." in opening
    assert opening.count("<svg") == 1
    assert re.findall(r"<h3>(.*?)</h3>", opening) == ["Who explores soonest"]
    assert opening.index("explores in 8.9 %") < opening.index("<table>") < opening.index("<svg")


def test_differences_within_chance_are_reported_as_such() -> None:
    text = sentence(with_times({GREEDY: [90, 112, 99, 105, 99], HEURISTIC: [100] * 5}))
    assert text.startswith("Whether temporal (greedy) or heuristic explores in less time can't be told from 5 pairs")
    assert "explores in 0.7 % more time on average" in text
    assert "less in 3 and more in 2" in text


def test_two_pairs_are_too_few_for_an_interval_or_a_verdict() -> None:
    outcome = with_times({GREEDY: [60, 71], HEURISTIC: [100, 100]})
    assert sentence(outcome) == (
        "temporal (greedy) explores in 34.7 % less time than heuristic on average over 2 pairs of missions on lobby "
        "(2 starts: too few for an interval); it needs less in 2 and more in 0."
    )
    assert outcome.pairing(CASE, GREEDY, QUALITY).sign is None
    page = dict(documents(outcome))["report.html"].decode()
    assert not re.search(r'class="(good|bad)"', page)


def test_a_mean_on_the_side_of_the_fewer_pairs_is_explained() -> None:
    outcome = with_times({GREEDY: [50, 102, 101, 103], HEURISTIC: [100, 100, 100, 100]})
    assert "less in 1 and more in 3, so the few differ by more" in sentence(outcome)


def test_the_best_of_several_is_named() -> None:
    anytime = Contender("temporal", "anytime")
    outcome = with_times({GREEDY: [90, 91], anytime: [80, 81], HEURISTIC: [100, 101]})
    assert sentence(outcome).startswith("temporal (anytime) explores in 19.9 % less time")


def test_where_temporal_is_the_base_its_own_gains_are_shown_in_the_same_measure() -> None:
    outcome = with_times({HEURISTIC: [200] * 5, GREEDY: [100] * 5})
    assert sentence(outcome).startswith("temporal (greedy) explores in 50.0 % less time than heuristic on average")
    assert [cell.text for cell in winners_table(outcome).rows[0]][1:] == ["temporal (greedy)", "+50.0 [+50.0, +50.0]"]
    assert "| all | heuristic | **+50.0 [+50.0, +50.0]**" in markdown(main_table(outcome))
    assert [(pair.kind, pair.gain) for pair in notable_pairs(outcome)] == [("best", 0.5), ("worst", 0.5)]


def test_a_single_contender_is_described_by_its_time() -> None:
    text = sentence(with_times({GREEDY: [90, 110]}))
    assert text == "temporal (greedy) explores in 100 s on average over 2 complete missions."


def test_no_axis_of_quality_goes_below_zero_and_no_frame_is_empty() -> None:
    comparison = lobby(runs=2, carriers=(1, 2))
    few = {trial: replace(invented(trial).row, quality=0.1 * trial.seed**3) for trial in comparison.trials()}
    svg = dict(documents(outcome_of(comparison, few)))["figures/time-and-quality-lobby.svg"].decode()
    numbers = re.findall(r">([−-]?[0-9.]+)</text>", svg)
    assert numbers
    assert not any(text[0] in "−-" for text in numbers)
    cut = dict(documents(outcome_of(comparison, upto=0)))
    assert not any(name.startswith("figures/") for name in cut)


def test_best_and_worst_pairs_are_those_with_most_and_least_saved() -> None:
    outcome = with_times({GREEDY: [50, 150, -1, 100], HEURISTIC: [100, 100, 10, 100]})
    found = notable_pairs(outcome)
    assert [(pair.kind, pair.seed, pair.gain) for pair in found] == [("best", 1, 0.5), ("worst", 2, -0.5)]
    assert found[0].path == "replays/best-lobby-1x1-temporal--greedy-seed1.html"


def test_pairs_that_can_be_watched_are_linked(tmp_path: Path) -> None:
    outcome = with_times({GREEDY: [50, 150], HEURISTIC: [100, 100]})
    assert replays_in(tmp_path, outcome) == {}
    best = notable_pairs(outcome)[0].path
    (tmp_path / best).parent.mkdir()
    (tmp_path / best).touch()
    text = dict(documents(outcome, replays=replays_in(tmp_path, outcome)))["report.html"].decode()
    said = "best pair of temporal (greedy): lobby 1x1, seed 1, 50.0 % less time than heuristic"
    assert f'<a href="{best}">{said}</a>' in text


def test_every_reader_can_distinguish_contenders_on_light_and_dark_pages() -> None:
    assert nearest(list(COLOURS)) >= 12
    assert min(contrast(colour, page) for colour in COLOURS for page in ("#ffffff", "#1b1f25")) >= 3
