"""The blocks of figures in README and docs, and ``python -m benchmarks figures``, which rewrites them."""

import argparse
import math
import re
from collections.abc import Sequence
from statistics import fmean

from benchmarks.figures.kept import COMMANDS, ROOT, carry_out, comparison, is_kept, origin, printed
from benchmarks.figures.picture import drawn, picture_file
from marsupial.bench.compare.cells import DISTANCE, EVERYWHERE, KNOWN, MISSION_TIME, TIME, ComparisonOutcome, Pairing
from marsupial.bench.compare.plan import budget_text
from marsupial.bench.compare.statements import Experiment, Finding, StatementVerdict
from marsupial.bench.compare.statistics import estimate
from marsupial.bench.compare.tables import (
    GAINS,
    ReportTable,
    ends_text,
    gain_cell,
    markdown,
    measure_table,
    standings,
)
from marsupial.errors import UsageError
from marsupial.model.planning import NO_PLANNER
from marsupial.papers import experiment
from marsupial.wording import counted, unknown_name

TABLES = "benchmarks/figures/tables.md"
"""The page of all tables that are too long for the others."""

PAGES = ("README.md", "docs/comparisons.md", "docs/examples.md", "docs/strategies.md", TABLES)
_BLOCK = re.compile(r"(<!-- figures: (\S+) (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
_APART = "-interference"  # ends the name of results that have their like without it

_EARLY_AND_LATE = (KNOWN[0], KNOWN[2], TIME, MISSION_TIME, DISTANCE)
BASELINE = "heuristic"  # the paper's
_BY_VERDICT = (StatementVerdict.FAILS, StatementVerdict.PARTLY, StatementVerdict.OPEN, StatementVerdict.HOLDS)


def transcript(name: str) -> str:
    """Return the output of a command."""
    command, made = origin(name)
    return f"```\n$ {command}\n{printed(name)}```\n\nPrinted {made}.\n"


def answer(name: str) -> str:
    """Return how much less time the base takes than the baseline of the paper and the best rule, in a sentence."""
    outcome = comparison(name)
    rules = [one for one in outcome.rivals if one.planner == NO_PLANNER and one != outcome.clairvoyant]
    parts = []
    for what, measure in (
        ("knows 90 % of a map", KNOWN[2]),
        ("explores all of it", TIME),
        ("ends missions", MISSION_TIME),
    ):
        gains = {rule.strategy: outcome.shown(outcome.cases, rule, measure).gain or 0.0 for rule in rules}
        best = min(gains, key=gains.__getitem__)
        than = f"than `{BASELINE}` and **{gains[best]:.0%}** less than `{best}`"
        parts.append(f"{what} in **{gains[BASELINE]:.0%}** less time {than}")
    told = f"On {counted(len(outcome.maps), 'map')} that no parameter was tuned on, `{outcome.base.strategy}` "
    return f"{told}{', '.join(parts[:-1])}, and {parts[-1]}.\n"


def picture(name: str) -> str:
    """Return the picture of a comparison with temporal; `main` draws it."""
    place = picture_file(name).relative_to(ROOT).as_posix()
    what = (
        "How much sooner temporal knows 90 % of a map, and explores all of it, than three rules and the method of the "
        "paper, by kind of map: means and 95 % intervals over maps"
    )
    return f"![{what}]({place})\n"


def results(name: str) -> str:
    """Return how contenders stand early and late: first where the base, or each one, is behind, then over all maps."""
    outcome = comparison(name)
    # older rows do not tell when shares of the area were known
    measures = [one for one in _EARLY_AND_LATE if any(getattr(row, one.column) is not None for row in outcome.rows)]
    late = measures.index(TIME)
    found = sorted(
        standings(outcome, measures), key=lambda row: (row[1] == outcome.clairvoyant, row[2][late].gain or 0)
    )
    behind = [row for row in found if row[0] != EVERYWHERE and row[1] != outcome.clairvoyant and _is_behind(row[2])]
    one, other = outcome.all_sides
    loser = f"{one} is" if outcome.about_base else "a contender is"
    table = ReportTable(
        title="",
        caption=f"How much less time and distance {one} takes than {other}, in per cent; less than 0: more. "
        f"{GAINS} Bold and italics: the interval leaves out 0. First the kinds of maps where {loser} behind in "
        "exploration time, or by more than chance in another time, then all.",
        heads=("where", "contender", *(f"{measure.heading}, %" for measure in measures)),
    )
    for where, contender, pairings in (*behind, *(row for row in found if row[0] == EVERYWHERE)):
        table.add(where, str(contender), *map(gain_cell, pairings))
    return f"{_untitled(table)}\n{_facts(name, outcome)}"


def _is_behind(pairings: Sequence[Pairing]) -> bool:
    """Return whether the base explores later in the mean, or takes more time for anything by more than chance."""
    times = [one for one in pairings if one.measure != DISTANCE]
    return any(one.sign == -1 or (one.measure == TIME and (one.gain or 0) < 0) for one in times)


def crowding(name: str) -> str:
    """Return what it costs each contender that robots keep apart, beside the missions in which they share cells."""
    outcome = comparison(name)
    shared = {row.trial: row for row in comparison(name.removesuffix(_APART)).rows if row.complete}
    table = ReportTable(
        title="",
        caption="A mission, in the mean, where robots keep apart: how often and how long robots wait for others, and "
        "deadlocks; and how much longer exploration takes than in the same mission with shared cells, as a geometric "
        "mean with its 95 % interval over maps.",
        heads=("contender", "complete", "waits", "waited, s", "deadlocks", "longer, %"),
    )
    for contender in outcome.contenders:
        rows = [row for row in outcome.rows if row.trial.contender == contender and row.waits is not None]
        whole = [row for row in rows if row.complete and row.trial in shared]
        ratios = [(row.exploration_time_s or 0) / (shared[row.trial].exploration_time_s or 1) for row in whole]
        longer = estimate([row.trial.origin for row in whole], [math.log(ratio) for ratio in ratios])
        table.add(
            str(contender),
            f"{sum(row.complete for row in rows)} of {len(rows)}",
            *(f"{fmean(getattr(row, column) for row in rows):.1f}" for column in ("waits", "waited_s", "deadlocks")),
            ends_text(longer and longer.mapped(lambda log: 100 * math.expm1(log)), 1, "+"),
        )
    return f"{_untitled(table)}\n{_facts(name, outcome)}"


def statements(name: str) -> str:
    """Return the statements of a paper with their verdicts, first what does not hold."""
    outcome, paper = _experiment(name)
    lines = ["| statement | verdict |", "|---|---|"]
    for finding in _findings(outcome, paper):
        lines.append(f"| {finding.statement} ({finding.where}) | {_verdict(finding)} |")
    command, _ = origin(name)
    return "\n".join(lines) + f"\n\n{counted(len(outcome.rows), 'mission')}, by `{command}`.\n"


def verdicts(name: str) -> str:
    """Return the same with the figures behind each verdict, and the experiment's tables."""
    outcome, paper = _experiment(name)
    lines = ["| statement | verdict | figures |", "|---|---|---|"]
    for finding in _findings(outcome, paper):
        lines.append(f"| {finding.statement} ({finding.where}) | {_verdict(finding)} | {'; '.join(finding.evidence)} |")
    return "\n".join(["\n".join(lines) + "\n", *map(_titled, paper.tables(outcome)), _facts(name, outcome)])


def _experiment(name: str) -> tuple[ComparisonOutcome, Experiment]:
    outcome = comparison(name)
    paper = experiment(outcome.header["paper"])
    if paper is None:
        raise UsageError(f"{name} holds no experiment of a paper")
    return outcome, paper


def _findings(outcome: ComparisonOutcome, paper: Experiment) -> list[Finding]:
    return sorted(paper.findings(outcome), key=lambda one: _BY_VERDICT.index(one.verdict))


def _verdict(finding: Finding) -> str:
    return str(finding.verdict) if finding.verdict is StatementVerdict.HOLDS else f"**{finding.verdict}**"


def times(name: str) -> str:
    """Return the exploration times by team, a table for each map."""
    outcome = comparison(name)
    found = (measure_table(outcome, TIME, scenario) for scenario in outcome.scenarios)
    return "\n".join([*map(_titled, found), _facts(name, outcome)])


_PARTS = (transcript, answer, picture, results, crowding, statements, verdicts, times)
PARTS = {part.__name__: part for part in _PARTS}
"""The parts of stored results that a block may show."""


def _titled(table: ReportTable) -> str:
    return f"**{table.title}.** {_untitled(table)}"


def _untitled(table: ReportTable) -> str:
    _, _, text = markdown(table).partition("\n\n")
    return text


def _facts(name: str, outcome: ComparisonOutcome) -> str:
    """Return what missions stored results are of, and how they were made."""
    rows, first = outcome.rows, outcome.header.get("first_seed", 1)
    teams = ", ".join(sorted({case.team for case in outcome.cases}))
    seeds = f"seed {first}" if outcome.runs == 1 else f"seeds {first} to {first + outcome.runs - 1}"
    planned = any(contender.planner != NO_PLANNER for contender in outcome.contenders)
    command, made = origin(name)
    return (
        f"{counted(len(rows), 'mission')}, {sum(row.complete for row in rows)} of them complete, on "
        f"{counted(len(outcome.maps), 'map')}; teams (carriers x rovers of each) {teams}; {seeds}; "
        f"{f'{budget_text(outcome.header)} for each planning; ' if planned else ''}"
        f"{sum(timing.cpu_s for timing in outcome.timings):.0f} s of CPU time. Made by `{command}` {made}.\n"
    )


def rebuilt(page: str) -> str:
    """Return the text of a page with all its blocks rewritten; raise a `UsageError` if one can't be."""

    def block(found: re.Match[str]) -> str:
        start, name, part, end = found.groups()
        if part not in PARTS:
            raise UsageError(unknown_name("part", part, PARTS))
        if is_kept(name):
            return f"{start}{PARTS[part](name)}{end}"
        command = name if name in COMMANDS else name.rpartition("-")[0]
        if command not in COMMANDS:
            raise UsageError(unknown_name("kept results", name, COMMANDS))
        return f"{start}Not carried out yet: `python -m benchmarks figures --missions {command}` does.\n{end}"

    return _BLOCK.sub(block, page)


def main(arguments: Sequence[str]) -> int:
    """Write all blocks, after running the missions if asked to."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks figures", description=__doc__)
    parser.add_argument("--missions", nargs="*", choices=COMMANDS, help="carry out these missions first [default: all]")
    missions = parser.parse_args(arguments).missions
    for name in [] if missions is None else missions or COMMANDS:
        carry_out(name)
    for page in PAGES:
        text = (ROOT / page).read_text(encoding="utf-8")
        (ROOT / page).write_text(rebuilt(text), encoding="utf-8")
        for name in (found[2] for found in _BLOCK.finditer(text) if found[3] == picture.__name__):
            picture_file(name).write_text(drawn(comparison(name)), encoding="utf-8")
    return 0
