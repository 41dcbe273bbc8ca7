import re
import warnings
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from compare_outcomes import CASE, outcome_of, with_times
from matplotlib.artist import Artist
from matplotlib.figure import Figure as Drawing
from scipy import stats
from support.processes.compare_workers import GREEDY, HEURISTIC, invented, lobby

from marsupial.bench.compare import tables
from marsupial.bench.compare.cells import QUALITY, TIME
from marsupial.bench.compare.figures import as_figure, mean_coverage
from marsupial.bench.compare.pairs import notable_pairs
from marsupial.bench.compare.plan import Case, Contender, Trial
from marsupial.bench.compare.report import documents
from marsupial.bench.compare.rows import Curve, MissionRow
from marsupial.bench.compare.statements import Finding, StatementVerdict
from marsupial.bench.compare.tables import main_table, markdown, measure_table, winners_table
from marsupial.strategies.clairvoyant import CLAIRVOYANT


def test_pairs_are_compared_seed_by_seed() -> None:
    outcome = with_times({GREEDY: [90, 100, 110, 100, 99], HEURISTIC: [100, 104, 108, 100, 107]})
    pairing = outcome.pairing(CASE, GREEDY, TIME)
    assert (pairing.wins, pairing.losses, pairing.ties) == (3, 1, 1)
    logs = np.log([90 / 100, 100 / 104, 110 / 108, 1, 99 / 107])
    low, high = stats.t.interval(0.95, 4, loc=logs.mean(), scale=stats.sem(logs))
    assert pairing.gain == pytest.approx(1 - np.exp(logs.mean()))
    assert pairing.estimate.low == pytest.approx(1 - np.exp(high))
    assert pairing.estimate.high == pytest.approx(1 - np.exp(low))
    assert pairing.sign == 0


KNOWING = Contender(CLAIRVOYANT)


def test_competitive_ratios_are_means_over_the_seeds_both_have_completed() -> None:
    outcome = with_times({GREEDY: [90, 120, -1], HEURISTIC: [100, 150, 80], KNOWING: [50, 100, 80]})
    ratio = outcome.ratio(CASE, GREEDY)
    assert (ratio.count, ratio.mean) == (2, pytest.approx((1.8 * 1.2) ** 0.5))
    row = tables.ratio_table(outcome, "lobby").rows[0]
    assert [cell.text for cell in row] == ["1x1", "1.47", "1.44"]


def test_strategies_are_not_compared_pair_by_pair_with_one_that_knows_the_map() -> None:
    outcome = with_times({GREEDY: [90, 120], HEURISTIC: [100, 150], KNOWING: [50, 100]})
    assert (outcome.base, outcome.rivals) == (HEURISTIC, (GREEDY,))
    page = dict(documents(outcome))["report.html"].decode()
    assert "Competitive ratio: lobby" in page
    assert "not a proven optimum" in page


def test_more_quality_counts_as_better_as_less_time_does() -> None:
    outcome = outcome_of(lobby(runs=5))
    for measure in (TIME, QUALITY):
        pairing = outcome.pairing(CASE, GREEDY, measure)
        assert (pairing.wins, pairing.losses) == (5, 0)
        assert pairing.sign == 1
    assert outcome.pairing(CASE, HEURISTIC, TIME, GREEDY).sign == -1


def test_missions_that_are_not_complete_count_in_no_mean_but_are_counted() -> None:
    outcome = with_times({GREEDY: [90, -1, 110], HEURISTIC: [100, 104, -1]})
    found = outcome.estimate(CASE, GREEDY, TIME)
    assert (found.count, found.mean) == (2, 100.0)
    pairing = outcome.pairing(CASE, GREEDY, TIME)
    assert (pairing.wins, pairing.losses) == (1, 0)
    assert outcome.statuses("lobby", GREEDY) == {"complete": 2, "stalled": 1}
    text = markdown(measure_table(outcome, TIME, "lobby"))
    assert "(2 of 3)" in text
    assert "| lobby | temporal (greedy) | 2 | _1_ | 0 |" in markdown(tables.status_table(outcome))
    assert "lobby 1x1, heuristic, seed 3 | _stalled_ | stuck" in markdown(tables.failure_table(outcome))


def test_a_case_without_a_complete_pair_has_no_difference() -> None:
    pairing = with_times({GREEDY: [-1, 90], HEURISTIC: [100, -1]}).pairing(CASE, GREEDY, TIME)
    assert (pairing.estimate, pairing.gain) == (None, None)


def test_tables_mark_what_is_shown_and_count_what_is_missing() -> None:
    whole = markdown(measure_table(outcome_of(lobby(runs=5)), TIME, "lobby"))
    assert "**+8.9 [+8.7, +9.0]** | 5/0/0" in whole
    comparison = lobby(runs=4)
    few = markdown(measure_table(outcome_of(comparison), TIME, "lobby"))
    assert "| +8.9 | 4/0/0" in few
    partly = outcome_of(comparison, upto=5)
    assert "| lobby | temporal (greedy) | 3 | 1 |" in markdown(tables.status_table(partly))
    assert "| 1x1 | 102.0 (3 of 4) | 111.5 (2 of 4) |" in markdown(measure_table(partly, TIME, "lobby"))


def test_several_contenders_are_each_compared_with_the_last() -> None:
    anytime = Contender("temporal", "anytime")
    outcome = with_times({GREEDY: [90] * 5, anytime: [120] * 5, HEURISTIC: [100] * 5})
    assert [[cell.text for cell in row[:3]] for row in main_table(outcome).rows] == [
        ["all", "temporal (anytime)", "-20.0 [-20.0, -20.0]"],
        ["all", "temporal (greedy)", "+10.0 [+10.0, +10.0]"],
    ]


def test_all_opponents_of_temporal_stand_in_the_main_table_those_it_loses_to_first() -> None:
    slower, faster = Contender("assignment"), Contender("heuristic-plus")
    outcome = with_times(
        {KNOWING: [50] * 5, slower: [120] * 5, faster: [80] * 5, HEURISTIC: [90] * 5, GREEDY: [100] * 5}
    )
    table = main_table(outcome)
    assert [row[1].text for row in table.rows] == ["heuristic-plus", "heuristic", "assignment", "clairvoyant"]
    assert [row[2].mark for row in table.rows] == ["bad", "bad", "good", "bad"]
    words = ("Exploration time", "Mission time", "Distance", "Energy")
    assert [head for head in table.heads if head.removesuffix(", %") in words] == [f"{word}, %" for word in words]


def test_the_table_of_winners_names_the_soonest_by_team_and_shows_losses() -> None:
    comparison = lobby(runs=5, carriers=(1, 2))
    times = {(GREEDY, 1): 120.0, (GREEDY, 2): 50.0}
    rows = {
        trial: replace(invented(trial).row, exploration_time_s=times.get((trial.contender, trial.case.carriers), 100.0))
        for trial in comparison.trials()
    }
    table = winners_table(outcome_of(comparison, rows))
    assert [[cell.text for cell in row[:2]] for row in table.rows] == [
        ["all", "temporal (greedy)"],
        ["1x1", "heuristic"],
        ["2x1", "temporal (greedy)"],
    ]
    assert [(row[2].text, row[2].mark) for row in table.rows[1:]] == [
        ("-20.0 [-20.0, -20.0]", "bad"),
        ("+50.0 [+50.0, +50.0]", "good"),
    ]


def test_who_knows_the_map_is_never_the_soonest_and_without_pairs_nobody_is() -> None:
    outcome = with_times({GREEDY: [90, 120], HEURISTIC: [100, 150], KNOWING: [50, 100]})
    assert [cell.text for cell in winners_table(outcome).rows[0]][1:] == ["temporal (greedy)", "+15.1", "+42.3"]
    nothing = with_times({GREEDY: [-1], HEURISTIC: [100]})
    assert [cell.text for cell in winners_table(nothing).rows[0]][1:] == ["–", "–"]


def test_fewer_than_five_starts_have_no_interval_and_no_verdict_in_time_or_quality() -> None:
    few, enough = (outcome_of(lobby(runs=runs)) for runs in (4, 5))
    for column in (2, 6):
        (none,), (some,) = ([row[column] for row in main_table(found).rows] for found in (few, enough))
        assert (re.fullmatch(r"[+]\d+[.]\d", none.text) is not None, none.mark) == (True, "")
        assert (re.fullmatch(r"[+]\d+[.]\d \[.*\]", some.text) is not None, some.mark) == (True, "good")


def test_teams_with_the_same_starts_add_no_certainty() -> None:
    outcome = outcome_of(lobby(runs=1, carriers=range(1, 7)))
    found = outcome.pairing(outcome.cases, GREEDY, TIME).estimate
    assert (found.count, found.units, found.half) == (6, "1 start", None)


def test_coverage_stays_where_it_was_when_a_mission_has_ended() -> None:
    trial = Trial(CASE, GREEDY, 1)
    known = [(0, 10_000), (2000, 4000, 8000), *[(1000, 7000, 9000)] * 3]
    curves = [Curve(trial=replace(trial, seed=seed), every_s=5.0, known=one) for seed, one in enumerate(known)]
    times, mean, half = mean_coverage(curves)
    assert times.tolist() == [0.0, 5.0, 10.0]
    assert mean.tolist() == pytest.approx([10.0, 70.0, 90.0])
    assert half[0] == pytest.approx(stats.sem([0, 20, 10, 10, 10]) * stats.t.ppf(0.975, 4))


class Page(HTMLParser):
    """Collects what a page refers to and the ids in it."""

    def __init__(self) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href"):
                self.references.append(value or "")
            if name == "id":
                self.ids.append(value or "")


def test_the_page_holds_all_figures_and_needs_nothing_else() -> None:
    written = dict(documents(outcome_of(lobby(runs=2, carriers=(1, 2)))))
    names = ("time-and-quality", "coverage")
    assert {f"figures/{name}-lobby.{kind}" for name in names for kind in ("svg", "png")} < written.keys()
    text = written["report.html"].decode()
    page = Page()
    page.feed(text)
    assert all(reference.startswith("#") for reference in page.references)
    assert page.tags.count("svg") == page.tags.count("figcaption") == 3
    assert len(page.ids) == len(set(page.ids))
    assert {reference[1:] for reference in page.references} <= set(page.ids)
    assert text.count("95 % intervals of the mean over complete missions") == 1
    assert "url(http" not in text
    assert written["tables.md"].decode().count("## ") >= 5


def test_documents_are_the_same_bytes_again_and_figures_can_be_read() -> None:
    outcome = outcome_of(lobby(runs=2))
    first, second = dict(documents(outcome)), dict(documents(outcome))
    assert first == second
    for name, data in first.items():
        if name.endswith(".svg"):
            ElementTree.fromstring(data)
        elif name.endswith(".png"):
            assert data.startswith(b"\x89PNG")


def test_a_comparison_with_few_missions_can_be_shown() -> None:
    comparison = lobby(runs=3)
    nothing = dict(documents(outcome_of(comparison, upto=0)))
    assert "6 of 6 missions are missing" in nothing["report.html"].decode()
    assert "5 of 6 missions are missing" in dict(documents(outcome_of(comparison, upto=1)))["report.html"].decode()


def test_text_of_rows_can_not_become_markup() -> None:
    comparison = lobby(runs=1)
    trial = next(comparison.trials())
    row = MissionRow(trial=trial, status="error", reason="<script>alert(1)</script> a|b")
    written = dict(documents(outcome_of(comparison, {trial: row})))
    assert "<script" not in written["report.html"].decode()
    assert "a\\|b" in written["tables.md"].decode()


def test_drawing_letters_that_the_font_lacks_changes_no_filter_of_other_threads() -> None:
    class OtherThread(Artist):
        def draw(self, renderer: object) -> None:
            warnings.filterwarnings("ignore", message="set while a figure is drawn")

    drawing = Drawing()
    drawing.text(0.5, 0.5, "\u5009\u5eab")
    drawing.add_artist(OtherThread())
    figure = as_figure(drawing, "store", "A store", "A store")
    assert "\u5009\u5eab" in figure.svg
    warnings.warn("set while a figure is drawn", stacklevel=1)  # an error without the filter


@pytest.mark.parametrize(
    ("held", "verdict"),
    [
        ([True, False], StatementVerdict.PARTLY),
        ([True, False, False], StatementVerdict.FAILS),
        ([True, None], StatementVerdict.OPEN),
        ([], StatementVerdict.OPEN),
    ],
)
def test_a_statement_for_several_places_may_hold_in_part(held: list[bool | None], verdict: StatementVerdict) -> None:
    finding = Finding(statement="It is fast", where="section 1", criterion="it is", held=held, evidence=[])
    assert finding.verdict is verdict


def test_maps_of_a_suite_are_grouped_by_kind_and_each_map_is_a_unit() -> None:
    ((_, scenario),) = lobby().scenarios.items()
    cases = [Case(f"{kind}-{number}", 1, 1) for number in range(101, 106) for kind in ("comb", "grid")]
    suite = replace(lobby(runs=2), scenarios=dict.fromkeys(cases, scenario), suite="footprint", first_seed=1001)
    outcome = outcome_of(suite)
    assert (outcome.scenarios, outcome.planned) == (("comb", "grid"), 40)
    found = outcome.pairing(outcome.cases_of("comb"), GREEDY, TIME).estimate
    assert (found.count, found.units) == (10, "5 maps")
    assert {pair.seed for pair in notable_pairs(outcome)} <= {1001, 1002}
    assert {pair.case for pair in notable_pairs(outcome)} <= set(cases)
    assert "over 10 maps" in dict(documents(outcome))["report.html"].decode()


def test_floors_of_a_suite_are_grouped_by_building() -> None:
    ((_, scenario),) = lobby().scenarios.items()
    cases = [Case(name, 1, 1) for name in ("kth_b1", "kth_b3", "fr101")]
    outcome = outcome_of(replace(lobby(runs=2), scenarios=dict.fromkeys(cases, scenario), suite="buildings"))
    assert (outcome.scenarios, len(outcome.maps)) == (("kth_b", "fr101"), 3)
    assert outcome.missions_of(Case("kth_b", 1, 1)) == 4
