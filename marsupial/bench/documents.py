"""All documents made of a comparison's rows: tables in Markdown, figures, and one page that holds them all."""

from __future__ import annotations

from collections.abc import Iterator

from marsupial.bench.compare.cells import ComparisonOutcome
from marsupial.bench.compare.figures import figures
from marsupial.bench.compare.report import page
from marsupial.bench.compare.statements import Finding, checklist, reading
from marsupial.bench.compare.tables import markdown, status_table, tables
from marsupial.bench.papers.catalogue import PAPERS


def documents(outcome: ComparisonOutcome) -> Iterator[tuple[str, bytes]]:
    """Yield the path in the folder and the content of each document; they depend on nothing but the outcome."""
    findings: list[Finding] = []
    experiment = PAPERS.get(str(outcome.header.get("paper")))
    overview = experiment is None or experiment.overview
    written, drawn = (tables(outcome), list(figures(outcome))) if overview else ([status_table(outcome)], [])
    if experiment is not None:
        written = [*experiment.tables(outcome), *written]
        drawn = [*experiment.figures(outcome), *drawn]
        findings = experiment.findings(outcome)
        yield "checklist.md", checklist(findings, reading(outcome.runs, experiment.paper_runs)).encode()
    yield "tables.md", "\n".join(map(markdown, written)).encode()
    for figure in drawn:
        yield f"figures/{figure.name}.svg", figure.svg.encode()
        yield f"figures/{figure.name}.png", figure.png
    yield "report.html", page(outcome, written, drawn, experiment, findings).encode()
