"""The tables of a comparison, as values; `markdown` writes one as text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import inf
from statistics import fmean

from marsupial.bench.compare.cells import EVERYWHERE, MEASURES, MOMENTS, QUALITY, TIME, ComparisonOutcome, Pairing
from marsupial.bench.compare.plan import Contender
from marsupial.bench.compare.statistics import FEWEST_UNITS, Estimate
from marsupial.library.metrics import Metric

GOOD, BAD = "good", "bad"

NOTHING = "–"
RATIO_DIGITS = 2

GAINS = (
    "Means are geometric, over pairs of missions with the same map, team and starts; in brackets the 95 % interval, "
    f"over maps or starts, from {FEWEST_UNITS} of these on."
)


@dataclass(frozen=True, slots=True)
class TableCell:
    """A text, marked `GOOD` or `BAD` if its interval is in favour of the contender or against it."""

    text: str
    mark: str = ""

    @property
    def is_number(self) -> bool:
        """Whether it has a digit, so that it stands to the right."""
        return any(letter.isdigit() for letter in self.text)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportTable:
    """A table with its caption."""

    title: str
    caption: str
    heads: tuple[str, ...]
    scenario: str = ""  # the scenario, if it is about a single one
    main: bool = True  # whether it is one of the scenario's main tables
    opening: bool = False  # whether it stands at the start of a page, with the answer
    rows: list[tuple[TableCell, ...]] = field(default_factory=list)

    def add(self, *cells: TableCell | str) -> None:
        self.rows.append(tuple(cell if isinstance(cell, TableCell) else TableCell(cell) for cell in cells))


def tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    made = [status_table(outcome)]
    if len(outcome.contenders) > 1:
        made = [winners_table(outcome), *moments_tables(outcome), main_table(outcome), *made]
    for measure in (TIME, QUALITY, *MEASURES[1:-1]):
        made += [measure_table(outcome, measure, scenario) for scenario in outcome.scenarios]
        if measure is TIME and outcome.clairvoyant and outcome.strategies:
            made += [ratio_table(outcome, scenario) for scenario in outcome.scenarios]
    made.append(planning_table(outcome))
    if outcome.incomplete():
        made.append(failure_table(outcome))
    return made


def status_table(outcome: ComparisonOutcome) -> ReportTable:
    counts = {(s, c): outcome.statuses(s, c) for s in outcome.scenarios for c in outcome.contenders}
    names = list(dict.fromkeys(name for found in counts.values() for name in found)) or ["complete"]
    table = ReportTable(
        title="Missions",
        caption="How the missions ended. Only complete ones count in means, only complete pairs in differences.",
        heads=("scenario", "contender", *names, "missing"),
    )
    for (scenario, contender), found in counts.items():
        missing = outcome.missions_of(*outcome.cases_of(scenario)) - found.total()
        ways = [TableCell(str(found[name]), BAD if name != "complete" and found[name] else "") for name in names]
        table.add(scenario, str(contender), *ways, str(missing))
    return table


def winners_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return who explores soonest in all, and by scenario or team, and how the others stand against the base."""
    base, others = outcome.base, [one for one in outcome.contenders if one != outcome.base]
    one, other = outcome.all_sides
    table = ReportTable(
        title="Who explores soonest",
        caption=f"How much less time {one} explores in than {other}, in per cent; less than 0: in more. {GAINS} "
        "Green and red: the interval leaves out 0. The soonest is so in the mean, of those that don't know the map.",
        heads=("where", "soonest", *(f"{contender}, %" for contender in others)),
        opening=True,
    )
    for where, cases in outcome.places.items():
        gains = {str(one): g for one in outcome.rivals if (g := outcome.pairing(cases, one, TIME).gain) is not None}
        soonest = max({str(base): 0.0} | gains, key=lambda one: gains.get(one, 0.0)) if gains else NOTHING
        table.add(where, soonest, *(gain_cell(outcome.shown(cases, one, TIME)) for one in others))
    return table


def moments_tables(outcome: ComparisonOutcome) -> list[ReportTable]:
    """Return who knows shares of the area soonest, from early to late; none for rows that do not tell it."""
    one, other = outcome.all_sides
    made = ReportTable(
        title="Early and late",
        caption=f"How much sooner {one} knows so much of the reachable area than {other}, in per cent of the other "
        f"one's time; less than 0: later. The mean is that of the moments at which cells became known. {GAINS}",
        heads=("where", "contender", *(f"{m.title}, %" for m in MOMENTS)),
        opening=True,
    )
    for where, contender, pairings in standings(outcome, MOMENTS):
        if pairings[0].logs:
            made.add(where, str(contender), *map(gain_cell, pairings))
    return [made] if made.rows else []


def main_table(outcome: ComparisonOutcome) -> ReportTable:
    """Return the main results: each contender and the base, in all and by scenario, losses first."""
    base, (one, other) = outcome.base, outcome.all_sides
    behind = f"{base} is behind" if outcome.about_base else f"a contender is behind {base}"
    table = ReportTable(
        title=f"{base} against all contenders" if outcome.about_base else f"All contenders against {base}",
        caption=f"How much less time, distance and energy {one} takes than {other}, and how much more Q it has, in "
        f"per cent, over all teams; less than 0: the opposite. {GAINS} Where {behind} stands first. Won, lost and "
        "tied are pairs by exploration time.",
        heads=("where", "contender", *(f"{m.heading}, %" for m in MEASURES[:-1]), "Q, %", "won/lost/tied"),
    )
    rows = []
    for where, contender, pairings in standings(outcome, MEASURES):
        lead = inf if (gain := pairings[0].gain) is None else gain
        rows.append(((where != EVERYWHERE, contender == outcome.clairvoyant, lead), where, contender, pairings))
    for _, where, contender, pairings in sorted(rows, key=lambda row: row[0]):
        table.add(where, str(contender), *map(gain_cell, pairings), _pair_cells(pairings[0])[1])
    return table


def standings(outcome: ComparisonOutcome, measures: Sequence[Metric]) -> Iterator[tuple[str, Contender, list[Pairing]]]:
    """Yield each contender but the base with its pairings as shown, in all and by scenario."""
    places = outcome.places if len(outcome.scenarios) > 1 else {EVERYWHERE: outcome.cases}
    for where, cases in places.items():
        for contender in (one for one in outcome.contenders if one != outcome.base):
            yield where, contender, [outcome.shown(cases, contender, measure) for measure in measures]


def measure_table(outcome: ComparisonOutcome, measure: Metric, scenario: str) -> ReportTable:
    """Return a metric by team: the mean of each contender, and its gain beside the base."""
    unit, (one, other) = measure.unit, outcome.all_sides
    several = len(outcome.rivals) > 1
    what, beside = "less" if measure.better < 0 else "more", "than" if outcome.about_base else "with"
    pair_heads: list[str] = []
    for rival in outcome.rivals:
        pair_heads += [f"{what}{f' {beside} {rival}' if several else ''}, %", "won/lost/tied"]
    table = ReportTable(
        title=f"{measure.heading}: {scenario}",
        caption=f"{measure.heading} in {unit}, mean ± half of the 95 % interval, and how much {what} it is with "
        f"{one} than with {other}, in per cent. {GAINS} Teams are carriers x rovers of each.",
        heads=("team", *(f"{contender}, {unit}" for contender in outcome.contenders), *pair_heads),
        scenario=scenario,
        main=measure in (TIME, QUALITY),
    )
    for case in outcome.cases_of(scenario):
        means = [
            mean_text(outcome.estimate(case, contender, measure), measure.digits, outcome.missions_of(case))
            for contender in outcome.contenders
        ]
        pairings = [outcome.shown(case, rival, measure) for rival in outcome.rivals]
        table.add(case.team, *means, *(cell for pairing in pairings for cell in _pair_cells(pairing)))
    return table


def ratio_table(outcome: ComparisonOutcome, scenario: str) -> ReportTable:
    table = ReportTable(
        title=f"Competitive ratio: {scenario}",
        caption="Exploration time as a multiple of that of the clairvoyant, who plans with the whole map known: "
        "geometric mean over the missions that both completed, with its 95 % interval. The clairvoyant's plan is the "
        "best one that a local search found, not proven best: the ratio to an optimum may be greater.",
        heads=("team", *map(str, outcome.strategies)),
        scenario=scenario,
    )
    for case in outcome.cases_of(scenario):
        table.add(case.team, *(ends_text(outcome.ratio(case, one), RATIO_DIGITS) for one in outcome.strategies))
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
            if found := [t for case in outcome.cases_of(scenario) for t in outcome.timings_of(case, contender)]:
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
    marks = {GOOD: "**", BAD: "_", "": ""}
    lines += [_line([f"{marks[cell.mark]}{cell.text}{marks[cell.mark]}" for cell in row]) for row in table.rows]
    return "\n".join(lines) + "\n"


def mean_text(found: Estimate | None, digits: int, runs: int, sign: str = "") -> str:
    """Return a mean with its interval, and with its number of missions if that is not `runs`."""
    if found is None:
        return NOTHING
    half = "" if found.half is None else f" ± {found.half:.{digits}f}"
    count = "" if found.count == runs else f" ({found.count} of {runs})"
    return f"{found.mean:{sign}.{digits}f}{half}{count}"


def percent(share: float | None) -> str:
    """Return a share in per cent, with sign."""
    return NOTHING if share is None else f"{100 * share:+.1f} %"


def ends_text(found: Estimate | None, digits: int, sign: str = "") -> str:
    """Return a mean and the ends of its interval; `sign` is "+" to show that of positive numbers too."""
    if found is None:
        return NOTHING
    numbers = (found.mean,) if found.low is None or found.high is None else (found.mean, found.low, found.high)
    mean, *ends = (f"{number:{sign}.{digits}f}" for number in numbers)
    return f"{mean} [{', '.join(ends)}]" if ends else mean


def gain_text(pairing: Pairing) -> str:
    """Return the mean gain in per cent with its interval."""
    found = pairing.estimate
    return ends_text(found and found.mapped(lambda share: 100 * share), 1, "+")


def gain_cell(pairing: Pairing) -> TableCell:
    """Return the mean gain in per cent with its interval, marked if that is all on one side of 0."""
    return TableCell(gain_text(pairing), {1: GOOD, -1: BAD}.get(pairing.sign or 0, ""))


def _pair_cells(pairing: Pairing) -> list[TableCell]:
    return [gain_cell(pairing), TableCell(f"{pairing.wins}/{pairing.losses}/{pairing.ties}")]


def _line(texts: Sequence[str]) -> str:
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"
