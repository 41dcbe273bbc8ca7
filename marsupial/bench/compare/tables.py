"""The tables of a comparison, as values; `markdown` writes one as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import fmean

from marsupial.bench.compare.cells import (
    DISTANCE,
    MISSION_TIME,
    QUALITY,
    TIME,
    ComparisonOutcome,
    Pairing,
    Tally,
    tally,
)
from marsupial.bench.compare.statistics import FEWEST_PAIRS, Estimate
from marsupial.library.metrics import Metric

GOOD, BAD = "good", "bad"

NOTHING = "–"

RATIO_DIGITS = 2

BETTER = "better and worse are cases where the 95 % interval of the paired differences leaves out 0"
"""Explanation of two columns of the main table."""


@dataclass(frozen=True, slots=True)
class TableCell:
    """A text, marked `GOOD` or `BAD` if its interval is in favour of the contender or against it."""

    text: str
    mark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportTable:
    """A table with its caption; `scenario` if it is about a single one, `main` if it is one of its main tables."""

    title: str
    caption: str
    heads: tuple[str, ...]
    scenario: str = ""
    main: bool = True
    rows: list[tuple[TableCell, ...]] = field(default_factory=list)

    def add(self, *cells: TableCell | str) -> None:
        """Add a row."""
        self.rows.append(tuple(cell if isinstance(cell, TableCell) else TableCell(cell) for cell in cells))


def tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    """Return all tables of a comparison."""
    made = [status_table(outcome)]
    if outcome.rivals:
        made.append(headline_table(outcome))
    for measure in (TIME, QUALITY, MISSION_TIME, DISTANCE):
        made += [measure_table(outcome, measure, scenario) for scenario in outcome.scenarios]
        if measure is TIME and outcome.clairvoyant and outcome.strategies:
            made += [ratio_table(outcome, scenario) for scenario in outcome.scenarios]
    made.append(planning_table(outcome))
    if outcome.incomplete():
        made.append(failure_table(outcome))
    return made


def status_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return the numbers of missions by status."""
    counts = {(s, c): outcome.statuses(s, c) for s in outcome.scenarios for c in outcome.contenders}
    names = list(dict.fromkeys(name for found in counts.values() for name in found)) or ["complete"]
    table = ReportTable(
        title="Missions",
        caption="How the missions ended. Only complete ones count in means, only complete pairs in differences.",
        heads=("scenario", "contender", *names, "missing"),
    )
    for (scenario, contender), found in counts.items():
        missing = outcome.runs * len(outcome.cases_of(scenario)) - found.total()
        ways = [TableCell(str(found[name]), BAD if name != "complete" and found[name] else "") for name in names]
        table.add(scenario, str(contender), *ways, str(missing))
    return table


def headline_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return the main results: per scenario, the numbers of cases in which a contender is ahead of the base."""
    table = ReportTable(
        title="In short",
        caption=f"Against {outcome.base}, over all team sizes. Gains are means over pairs of 1 - time / base's time "
        f"and of Q / base's Q - 1, ± half of the 95 % interval from {FEWEST_PAIRS} pairs on; {BETTER}; "
        "pairs are missions with the same map, team and starts.",
        heads=("scenario", "contender", "metric", "gain", "better", "worse", "won/lost/tied"),
    )
    for scenario in outcome.scenarios:
        for rival in outcome.rivals:
            for measure in (TIME, QUALITY):
                found = tally([outcome.pairing(case, rival, measure) for case in outcome.cases_of(scenario)])
                table.add(
                    scenario,
                    str(rival),
                    "time" if measure is TIME else "Q",
                    _gain_text(found, measure),
                    f"{found.ahead} of {found.cells}",
                    f"{found.behind} of {found.cells}",
                    f"{found.wins}/{found.losses}/{found.ties}",
                )
    return table


def measure_table(outcome: ComparisonOutcome, measure: Metric, scenario: str) -> ReportTable:
    """Return a metric by team: the mean of each contender, and paired differences from the base."""
    unit = measure.unit
    several = len(outcome.rivals) > 1
    pair_heads: list[str] = []
    for rival in outcome.rivals:
        by_whom = f" by {rival}" if several else ""
        name = "saved" if measure.better < 0 else "gained"
        pair_heads += [f"{name}{by_whom}, of the mean", f"{name}{by_whom}, {unit} (95 % interval)", "won/lost/tied"]
    table = ReportTable(
        title=f"{measure.heading}: {scenario}",
        caption=f"{measure.heading} in {unit}, mean ± half of the 95 % confidence interval, and the paired "
        f"{'saving' if measure.better < 0 else 'gain'} against {outcome.base}, also as a share of its mean, in which "
        "long missions weigh more than in the mean of the pairs' shares above; teams are carriers x rovers of each.",
        heads=("team", *(f"{contender}, {unit}" for contender in outcome.contenders), *pair_heads),
        scenario=scenario,
        main=measure in (TIME, QUALITY),
    )
    for case in outcome.cases_of(scenario):
        found = [outcome.estimate(case, contender, measure) for contender in outcome.contenders]
        means = [mean_text(one, measure.digits, outcome.runs) for one in found]
        pairings = [outcome.pairing(case, rival, measure) for rival in outcome.rivals]
        table.add(case.team, *means, *(cell for pairing in pairings for cell in _pair_cells(pairing, measure)))
    return table


def ratio_table(outcome: ComparisonOutcome, scenario: str) -> ReportTable:
    """Return the competitive ratio of each contender by team."""
    table = ReportTable(
        title=f"Competitive ratio: {scenario}",
        caption="Exploration time as a multiple of that of the clairvoyant, who plans with the whole map known: mean "
        "over the missions that both completed ± half of the 95 % confidence interval. The clairvoyant's plan is the "
        "best one that a local search found, not proven best: the ratio to an optimum may be greater.",
        heads=("team", *map(str, outcome.strategies)),
        scenario=scenario,
    )
    for case in outcome.cases_of(scenario):
        ratios = [mean_text(outcome.ratio(case, one), RATIO_DIGITS, outcome.runs) for one in outcome.strategies]
        table.add(case.team, *ratios)
    return table


def planning_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return wall-clock times of planning and CPU times of missions by contender and scenario."""
    table = ReportTable(
        title="Planning time",
        caption="Wall-clock time on the machine that ran the missions, other workers beside: median, 95th percentile "
        "and maximum over one mission's plannings, each averaged over the missions (the last column is the greatest "
        "of all), and the processors' time of a whole mission.",
        heads=("scenario", "contender", "median, ms", "p95, ms", "max, ms", "greatest, ms", "CPU per mission, s"),
    )
    for scenario in outcome.scenarios:
        for contender in outcome.contenders:
            found = [t for case in outcome.cases_of(scenario) for t in outcome.timings_of(case, contender)]
            if found:
                times_s = (
                    fmean(t.planning_median_s for t in found),
                    fmean(t.planning_p95_s for t in found),
                    fmean(t.planning_max_s for t in found),
                    max(t.planning_max_s for t in found),
                )
                cpu = f"{fmean(t.cpu_s for t in found):.2f}"
                table.add(scenario, str(contender), *(f"{1000 * seconds:.1f}" for seconds in times_s), cpu)
    return table


def failure_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return the incomplete missions with their reasons."""
    table = ReportTable(
        title="Missions that are not complete",
        caption="Each with its reason; `marsupial run` with the same scenario, team, seed and steps shows it again.",
        heads=("mission", "status", "reason"),
    )
    for row in outcome.incomplete():
        table.add(str(row.trial), TableCell(row.status, BAD), row.reason)
    return table


def markdown(table: ReportTable) -> str:
    """Return a table as Markdown: `GOOD` cells bold, `BAD` ones in italics."""
    lines = [f"## {table.title}", "", table.caption, "", _line(table.heads)]
    lines.append("|" + "|".join("---" if i == 0 else "---:" for i in range(len(table.heads))) + "|")
    lines += [_line([_marked(cell) for cell in row]) for row in table.rows]
    return "\n".join(lines) + "\n"


def mean_text(found: Estimate | None, digits: int, runs: int) -> str:
    """Return a mean with its interval, and with its number of missions if that is not `runs`."""
    if found is None:
        return NOTHING
    half = "" if found.half is None else f" ± {found.half:.{digits}f}"
    count = "" if found.count == runs else f" ({found.count} of {runs})"
    return f"{found.mean:.{digits}f}{half}{count}"


def percent(share: float | None) -> str:
    """Return a share in per cent, with sign."""
    return NOTHING if share is None else f"{100 * share:+.1f} %"


def _gain_text(found: Tally, measure: Metric) -> str:
    """Return a mean gain with half its interval; no gain in quality without an interval, as it is easily misread."""
    if found.gain is None or (found.half is None and measure is QUALITY):
        return NOTHING
    return percent(found.gain) if found.half is None else f"{100 * found.gain:+.1f} ± {100 * found.half:.1f} %"


def interval_text(found: Estimate | None, digits: int) -> str:
    """Return a mean difference and the ends of its interval."""
    if found is None:
        return NOTHING
    ends = "" if found.half is None else f" [{found.low:+.{digits}f}, {found.high:+.{digits}f}]"
    return f"{found.mean:+.{digits}f}{ends}"


def _pair_cells(pairing: Pairing, measure: Metric) -> list[TableCell]:
    sign = 0 if pairing.ahead is None else pairing.ahead.sign
    mark = {1: GOOD, 0: "", -1: BAD}[sign]
    hidden = measure is QUALITY and (pairing.ahead is None or pairing.ahead.half is None)
    return [
        TableCell(NOTHING if hidden else percent(pairing.gain), mark),
        TableCell(NOTHING if hidden else interval_text(pairing.ahead, measure.digits), mark),
        TableCell(f"{pairing.wins}/{pairing.losses}/{pairing.ties}"),
    ]


def _line(texts: Sequence[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"


def _marked(cell: TableCell) -> str:
    return {GOOD: f"**{cell.text}**", BAD: f"_{cell.text}_", "": cell.text}[cell.mark]
