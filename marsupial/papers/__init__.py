"""One folder per paper: its rules as strategies, its experiment, its printed numbers.

`marsupial reproduce` repeats an experiment by its name here. Experiments are imported on demand; the registry of
strategies imports rules likewise.
"""

from __future__ import annotations

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from marsupial.bench.compare.statements import Experiment

PAPERS: Mapping[str, str] = {
    "wurm2010": "marsupial.papers.wurm2010.experiment:EXPERIMENT",
    "wurm2008": "marsupial.papers.wurm2008.experiment:EXPERIMENT",
    "alkhawaldah": "marsupial.papers.alkhawaldah.experiment:EXPERIMENT",
    "mei": "marsupial.papers.mei2006.experiment:EXPERIMENT",
}
"""Experiments of the command line, and where to import them from."""

PARTS: Mapping[str, str] = {
    "alkhawaldah-weights": "marsupial.papers.alkhawaldah.weights:EXPERIMENT",
    "mei-corner": "marsupial.papers.mei2006.experiment:CORNER_EXPERIMENT",
    "wurm2008-clutter": "marsupial.papers.wurm2008.experiment:CLUTTER_EXPERIMENT",
    "alkhawaldah-triples": "marsupial.papers.alkhawaldah.triples:EXPERIMENT",
}
"""Parts of these experiments, and other experiments that run by their own names only."""


def experiment(name: str) -> Experiment | None:
    """Return the experiment, or part of one, with this name; None if unknown."""
    target = {**PAPERS, **PARTS}.get(name)
    return None if target is None else resolve_name(target)
