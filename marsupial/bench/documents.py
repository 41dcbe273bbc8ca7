"""All documents made of a comparison's rows: tables in Markdown, figures, and one page that holds them all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from marsupial.bench.compare.answer import answer_figure
from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.figures import figures
from marsupial.bench.compare.pairs import PairReplay
from marsupial.bench.compare.report import Opening, page
from marsupial.bench.compare.statements import Finding, checklist, reading
from marsupial.bench.compare.tables import markdown, status_table, tables
from marsupial.bench.papers import catalogue


def documents(outcome: ComparisonOutcome, replays: Sequence[PairReplay] = ()) -> Iterator[tuple[str, bytes]]:
    """Yield the path in the folder and the content of each document; they depend on nothing but the outcome.

    `replays` are the pages of pairs that the folder holds, to be linked.
    """
    findings: list[Finding] = []
    experiment = catalogue.experiment(str(outcome.header.get("paper")))
    overview = experiment is None or experiment.overview
    written, drawn = (tables(outcome), list(figures(outcome))) if overview else ([status_table(outcome)], [])
    answer = answer_figure(outcome) if experiment is None else None
    if experiment is not None:
        written = [*experiment.tables(outcome), *written]
        drawn = [*experiment.figures(outcome), *drawn]
        findings = experiment.findings(outcome)
        yield "checklist.md", checklist(findings, reading(outcome.runs, experiment.paper_runs)).encode()
    yield "tables.md", "\n".join(map(markdown, written)).encode()
    for figure in (*filter(None, [answer]), *drawn):
        yield f"figures/{figure.name}.svg", figure.svg.encode()
        yield f"figures/{figure.name}.png", figure.png
    yield "report.html", page(outcome, written, drawn, Opening(answer, replays), experiment, findings).encode()
