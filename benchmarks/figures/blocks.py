"""The blocks of figures in README and docs, and ``python -m benchmarks figures``, which rewrites them."""

import argparse
import re
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.figures.kept import COMMANDS, ROOT, carry_out, comparison, origin, printed
from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.plan import budget_text
from marsupial.bench.compare.tables import EVERYWHERE, GAINS, ReportTable, main_table, markdown
from marsupial.errors import UsageError
from marsupial.wording import counted, unknown_name

PAGES = ("README.md", "docs/comparisons.md", "docs/benchmarks.md")
_BLOCK = re.compile(r"(<!-- figures: (\S+) (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


def transcript(name: str) -> str:
    """Return the output of a command."""
    return f"```\n$ marsupial {COMMANDS[name]}\n{printed(name)}```\n\nPrinted {origin(name)}.\n"


def losses(name: str) -> str:
    """Return the kinds of map on which the base of a comparison explores more slowly, then its result on all maps."""
    outcome = comparison(name)
    table = main_table(outcome)
    behind = [row for row in table.rows if row[0].text != EVERYWHERE and row[2].text.startswith("+")]
    overall = [row for row in table.rows if row[0].text == EVERYWHERE]
    caption = (
        f"What each saves of the time and distance of {outcome.base}, in per cent; less than 0: it takes more. {GAINS} "
        "Bold and italics: the interval leaves out 0. "
        f"First the kinds of maps on which {outcome.base} explores later in the mean, then all."
    )
    rows = [row[:5] for row in (*behind, *overall)]
    return _written(name, outcome, replace(table, caption=caption, heads=table.heads[:5], rows=rows))


def results(name: str) -> str:
    """Return the main table of a comparison."""
    outcome = comparison(name)
    return _written(name, outcome, main_table(outcome))


PARTS = {"transcript": transcript, "losses": losses, "results": results}
"""The parts of stored results that a block may show."""


def _written(name: str, outcome: ComparisonOutcome, table: ReportTable) -> str:
    """Return a table without its title, and its source."""
    rows, first = outcome.rows, outcome.header.get("first_seed", 1)
    teams = ", ".join(sorted({case.team for case in outcome.cases}))
    seeds = f"seed {first}" if outcome.runs == 1 else f"seeds {first} to {first + outcome.runs - 1}"
    facts = (
        f"{counted(len(rows), 'mission')}, {sum(row.complete for row in rows)} of them complete, on "
        f"{counted(len(outcome.maps), 'map')}; teams (carriers x rovers of each) {teams}; {seeds}; "
        f"{budget_text(outcome.header)} for each planning; "
        f"{sum(timing.cpu_s for timing in outcome.timings):.0f} s of CPU time. "
        f"Made by `marsupial {COMMANDS[name]}` {origin(name)}."
    )
    _, _, text = markdown(table).partition("\n\n")
    return f"{text}\n{facts}\n"


def rebuilt(page: str) -> str:
    """Return the text of a page with all its blocks rewritten; raise a `UsageError` if one can't be."""

    def block(found: re.Match[str]) -> str:
        start, name, part, end = found.groups()
        for kind, asked, known in (("kept results", name, COMMANDS), ("part", part, PARTS)):
            if asked not in known:
                raise UsageError(unknown_name(kind, asked, known))
        return f"{start}{PARTS[part](name)}{end}"

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
    return 0
