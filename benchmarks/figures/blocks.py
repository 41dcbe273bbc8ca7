"""The blocks of figures in README and docs, and ``python -m benchmarks figures``, which rewrites them."""

import argparse
import math
import re
from collections.abc import Sequence
from statistics import fmean

from benchmarks.figures.kept import COMMANDS, ROOT, carry_out, comparison, is_kept, origin, printed
from benchmarks.figures.picture import drawn, picture_file
from marsupial.bench.compare.cells import DISTANCE, EVERYWHERE, KNOWN, MISSION_TIME, TIME, ComparisonOutcome
from marsupial.bench.compare.plan import budget_text
from marsupial.bench.compare.statements import StatementVerdict
from marsupial.bench.compare.statistics import estimate
from marsupial.bench.compare.tables import (
    GAINS,
    ReportTable,
    ends_text,
    gain_cell,
    main_table,
    markdown,
    measure_table,
    moments_tables,
    standings,
)
from marsupial.errors import UsageError
from marsupial.model.planning import NO_PLANNER
from marsupial.papers import experiment
from marsupial.wording import counted, unknown_name

PAGES = ("README.md", "docs/comparisons.md", "docs/benchmarks.md", "docs/examples.md", "docs/strategies.md")
_BLOCK = re.compile(r"(<!-- figures: (\S+) (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
_APART = "-interference"  # ends the name of results that have their like without it

_EARLY_AND_LATE = (KNOWN[0], KNOWN[2], TIME, MISSION_TIME, DISTANCE)
_BY_VERDICT = (StatementVerdict.FAILS, StatementVerdict.PARTLY, StatementVerdict.OPEN, StatementVerdict.HOLDS)


def transcript(name: str) -> str:
    """Return the output of a command."""
    command, made = origin(name)
    return f"```\n$ {command}\n{printed(name)}```\n\nPrinted {made}.\n"


def losses(name: str) -> str:
    """Return how the base of a comparison stands early and late, first the kinds of map on which it explores later."""
    outcome = comparison(name)
    # older rows do not tell when shares of the area were known
    measures = [one for one in _EARLY_AND_LATE if any(getattr(row, one.column) is not None for row in outcome.rows)]
    time_at = measures.index(TIME)
    rivals = [row for row in standings(outcome, measures) if row[1] != outcome.clairvoyant]
    rivals.sort(key=lambda row: row[2][time_at].gain or 0)
    behind = [row for row in rivals if row[0] != EVERYWHERE and (row[2][time_at].gain or 0) < 0]
    table = ReportTable(
        title="",
        caption=f"How much less time and distance {outcome.base} takes than each, in per cent; less than 0: more. "
        f"{GAINS} Bold and italics: the interval leaves out 0. "
        f"First the kinds of maps on which {outcome.base} explores later in the mean, then all.",
        heads=("where", "contender", *(f"{measure.heading}, %" for measure in measures)),
    )
    for where, contender, pairings in (*behind, *(row for row in rivals if row[0] == EVERYWHERE)):
        table.add(where, str(contender), *map(gain_cell, pairings))
    return f"{_untitled(table)}\n{_facts(name, outcome)}"


def moments(name: str) -> str:
    """Return who knows shares of the area soonest, from early to late."""
    outcome = comparison(name)
    return "\n".join([*map(_untitled, moments_tables(outcome)), _facts(name, outcome)])


def picture(name: str) -> str:
    """Return the picture of a comparison with temporal; `main` draws it."""
    place = picture_file(name).relative_to(ROOT).as_posix()
    what = "How much less time temporal explores in than four rules, by kind of map: means and 95 % intervals over maps"
    return f"![{what}]({place})\n"


def results(name: str) -> str:
    """Return the main table of a comparison."""
    outcome = comparison(name)
    return f"{_untitled(main_table(outcome))}\n{_facts(name, outcome)}"


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


def verdicts(name: str) -> str:
    """Return the statements of a paper with their verdicts, first what does not hold, and the experiment's tables."""
    outcome = comparison(name)
    paper = experiment(outcome.header["paper"])
    if paper is None:
        raise UsageError(f"{name} holds no experiment of a paper")
    lines = ["| statement | verdict | figures |", "|---|---|---|"]
    for finding in sorted(paper.findings(outcome), key=lambda one: _BY_VERDICT.index(one.verdict)):
        verdict = str(finding.verdict) if finding.verdict is StatementVerdict.HOLDS else f"**{finding.verdict}**"
        lines.append(f"| {finding.statement} ({finding.where}) | {verdict} | {'; '.join(finding.evidence)} |")
    return "\n".join(["\n".join(lines) + "\n", *map(_titled, paper.tables(outcome)), _facts(name, outcome)])


def times(name: str) -> str:
    """Return the exploration times by team, a table for each map."""
    outcome = comparison(name)
    found = (measure_table(outcome, TIME, scenario) for scenario in outcome.scenarios)
    return "\n".join([*map(_titled, found), _facts(name, outcome)])


PARTS = {part.__name__: part for part in (transcript, losses, moments, picture, results, crowding, verdicts, times)}
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
