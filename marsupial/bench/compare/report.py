"""All documents of a comparison: tables in Markdown, figures, and one page with everything.

The page is self-contained: figures are inline, for light and dark screens.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from importlib.resources import files
from types import MappingProxyType

from marsupial.bench.compare.answer import answer_figure, sentence
from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.figures import INK, Figure, figures
from marsupial.bench.compare.plan import budget_text
from marsupial.bench.compare.statements import Experiment, Finding, checklist, reading
from marsupial.bench.compare.statistics import FEWEST_UNITS
from marsupial.bench.compare.tables import ReportTable, TableCell, markdown, status_table, tables
from marsupial.exports.style import plain_style
from marsupial.wording import counted

_SLOT = re.compile(r"\{\{(\w+)\}\}")

_CLAIRVOYANT = (
    "The clairvoyant plans once, with the whole map known, and its plan is carried out in the same simulated world. "
    "Its exploration time is the moment at which every reachable cell has been seen, without the walls beside them, "
    "which the others must see too. The plan is the best one that a "
    "local search found, not a proven optimum. A competitive ratio is an exploration time divided by the clairvoyant's "
    "of the same seed."
)


def documents(
    outcome: ComparisonOutcome, experiment: Experiment | None = None, replays: Mapping[str, str] = MappingProxyType({})
) -> Iterator[tuple[str, bytes]]:
    """Yield path and content of each document.

    `experiment` is that of the paper, if the comparison belongs to one; `replays` are the texts of links by path.
    """
    findings: list[Finding] = []
    overview = experiment is None or experiment.overview
    written = tables(outcome) if overview else [status_table(outcome)]
    with plain_style():
        drawn = [
            *(experiment.figures(outcome) if experiment is not None else ()),
            *(figures(outcome) if overview else ()),
        ]
        answer = answer_figure(outcome) if experiment is None else None
    if experiment is not None:
        written = [*experiment.tables(outcome), *written]
        findings = experiment.findings(outcome)
        yield "checklist.md", checklist(findings, reading(outcome.runs, experiment.paper_runs)).encode()
    yield "tables.md", "\n".join(map(markdown, written)).encode()
    for figure in (*filter(None, [answer]), *drawn):
        yield f"figures/{figure.name}.svg", figure.svg.encode()
        yield f"figures/{figure.name}.png", figure.png
    if experiment is None:
        first = _section("The answer", _answer(outcome, answer, [table for table in written if table.opening], replays))
    else:
        first = _section("Statements of the paper", _findings(findings, reading(outcome.runs, experiment.paper_runs)))
    yield "report.html", _page(outcome, first, written, drawn, experiment).encode()


def _page(
    outcome: ComparisonOutcome,
    first: str,
    tables: Sequence[ReportTable],
    figures: Sequence[Figure],
    experiment: Experiment | None,
) -> str:
    """Return the page: the `first` section, tables and figures by scenario, overall tables, the method."""
    facts = (
        f"{counted(len(outcome.rows), 'mission')}: {counted(len(outcome.contenders), 'contender')}, "
        f"{counted(len(outcome.cases), 'case')} on {counted(len(outcome.maps), 'map')}, "
        f"{counted(outcome.runs, 'run')} each; {budget_text(outcome.header)} for each planning; "
        f"marsupial {outcome.header['marsupial']}"
    )
    of_all = [_figure(figure) for figure in figures if not figure.scenario]
    title = f"{' / '.join(map(str, outcome.contenders))}: {', '.join(outcome.scenarios)}"
    others = (table for table in tables if not table.scenario and (experiment is not None or not table.opening))
    sections = [
        first,
        *([_section("Results", "\n".join(of_all))] if of_all else []),
        *(_section(scenario, _of_scenario(scenario, tables, figures)) for scenario in outcome.scenarios),
        _section("In numbers", "\n".join(map(_table, others))),
        _section("Method", _method(outcome, experiment)),
    ]
    parts = {
        "title": escape(title if experiment is None else experiment.title),
        "style": _read("report.css"),
        "facts": escape(facts),
        "warning": "".join(f'<p class="notice">{escape(notice)}</p>\n' for notice in _notices(outcome)),
        "body": "\n".join(sections),
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], _read("report.html"))


def _notices(outcome: ComparisonOutcome) -> Iterator[str]:
    missing, failed = outcome.planned - len(outcome.rows), len(outcome.incomplete())
    if missing:
        yield f"{missing} of {outcome.planned} missions are missing: this is what there is so far."
    if failed:
        yield f"{failed} of {len(outcome.rows)} missions are not complete and count in no mean."


def _answer(
    outcome: ComparisonOutcome, figure: Figure | None, opening: Sequence[ReportTable], replays: Mapping[str, str]
) -> str:
    """Return the answer in words, as tables and as a plot, with links to replays."""
    parts = [f'<p class="answer">{escape(sentence(outcome))}</p>', *map(_table, opening)]
    if figure is not None:
        parts.append(_figure(figure))
    if replays:
        links = (f'<li><a href="{escape(path)}">{escape(text)}</a></li>' for path, text in replays.items())
        parts.append(f'<p>To be watched side by side, on one clock:</p>\n<ul class="replays">{"".join(links)}</ul>')
    return "\n".join(parts)


def _read(name: str) -> str:
    return files("marsupial.bench.compare").joinpath(name).read_text(encoding="utf-8")


def _section(title: str, content: str) -> str:
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>"


def _of_scenario(scenario: str, tables: Sequence[ReportTable], figures: Sequence[Figure]) -> str:
    """Return figures and main tables of a scenario, the others folded away."""
    own = [table for table in tables if table.scenario == scenario]
    parts = [_figure(figure) for figure in figures if figure.scenario == scenario]
    parts += [_table(table) for table in own if table.main]
    if folded := "\n".join(_table(table) for table in own if not table.main):
        parts.append(f"<details><summary>More metrics</summary>\n{folded}\n</details>")
    return "\n".join(parts)


def _figure(figure: Figure) -> str:
    return f'<figure tabindex="0">\n{inlined(figure)}\n<figcaption>{escape(figure.caption)}</figcaption>\n</figure>'


def inlined(figure: Figure) -> str:
    """Return a figure's SVG as an element of a page: in the page's ink, with ids of its own."""
    text = figure.svg[figure.svg.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = text.replace(INK, "currentColor")
    text = re.sub(r'(\bid="|url\(#|href="#)', lambda found: f"{found[1]}{figure.name}-", text)
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(figure.title)}" ', 1).strip()


def _table(table: ReportTable) -> str:
    first = table.rows[0] if table.rows else [TableCell("")] * len(table.heads)
    kinds = ("" if below.is_number else ' class="text"' for below in first)
    heads = "".join(f"<th{kind}>{escape(head)}</th>" for head, kind in zip(table.heads, kinds, strict=True))
    rows = "\n".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    return (
        f"<h3>{escape(table.title)}</h3>\n"
        f'<p class="caption">{escape(table.caption)}</p>\n'
        f'<div class="scroll" tabindex="0"><table>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody>\n</table></div>"
    )


def _cell(cell: TableCell) -> str:
    kinds = {cell.mark: True, "text": not cell.is_number, "wrap": len(cell.text) > 60}
    names = " ".join(kind for kind, holds in kinds.items() if kind and holds)
    attribute = f' class="{names}"' if names else ""
    return f"<td{attribute}>{escape(cell.text)}</td>"


def _findings(findings: Sequence[Finding], introduction: str) -> str:
    items = []
    for finding in findings:
        badge = f'<span class="verdict {finding.verdict.name.lower()}">{escape(finding.verdict)}</span>'
        evidence = "".join(f"<li>{escape(line)}</li>" for line in finding.evidence)
        items.append(
            f"<li><p>{badge}<strong>{escape(finding.statement)}</strong> ({escape(finding.where)})</p>\n"
            f'<p class="caption">Criterion: {escape(finding.criterion)}.</p>\n<ul>{evidence}</ul></li>'
        )
    return f'<p class="caption">{escape(introduction)}</p>\n<ol class="checklist">\n{"".join(items)}\n</ol>'


def _method(outcome: ComparisonOutcome, experiment: Experiment | None) -> str:
    header = outcome.header
    first = header.get("first_seed", 1)
    versions = ", ".join(f"{name} {number}" for name, number in header.get("made_with", {}).items())
    reproducible = "steps" in header["budget"]
    paragraphs = [
        ("Robots keep out of each other's footprints. " if any(c.get("interference") for c in header["cases"]) else "")
        + "All contenders have the same missions: the same maps, teams and starts, drawn by seeds "
        f"{first} to {first + outcome.runs - 1}. Planning takes no time of the mission, and each planning has "
        f"{budget_text(header)}"
        + (
            ": the rows do not depend on the machine, and the same command gives them again, byte for byte."
            if reproducible
            else " of wall-clock time, so the rows depend on the machine."
        ),
        "Exploration time is the simulated time at which no frontier was left that any robot of the team could reach; "
        "mission time ends when the rovers are aboard again too. Distance is what robots drive themselves. Exploration "
        "quality Q is the explored part of the reachable area by the sum of all distances; more is better.",
        "Means are over complete missions; a mission that ended in another way is counted, but its time would say "
        "nothing. Gains are taken mission by mission over the pairs that are both complete, as the logarithm of the "
        "ratio, in time, distance and energy as in Q; what is told is the geometric mean as a share, and more than 0 "
        "is in favour of the contender.",
        "Missions from the same start turn out alike with every team, and so do missions on the same map. So the "
        "values of a start are averaged first, then those of a map; floors of a building count as one map. "
        f"With {FEWEST_UNITS} maps or more, the 95 % interval is that of Student's t over the maps' means, and says "
        "what to expect on other maps of their kind. With fewer, it is over the starts' means within each map, and "
        f"holds for these maps alone. With fewer than {FEWEST_UNITS} independent starts there is none, and nothing is "
        "marked as a difference. No correction is made for the number of cells: of 20 without any difference, one may "
        "show one.",
        f"Made with marsupial {header['marsupial']}; begun with {versions}. Rows are in rows.csv, wall-clock times in "
        "timings.csv, coverage over time in coverage.csv.",
    ]
    if outcome.clairvoyant:
        paragraphs.insert(-1, _CLAIRVOYANT)
    if experiment is not None:
        paragraphs.insert(0, experiment.setting)
    return "\n".join(f"<p>{escape(paragraph)}</p>" for paragraph in paragraphs)
