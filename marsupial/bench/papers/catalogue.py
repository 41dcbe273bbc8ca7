"""The experiments that can be carried out again, by name; each is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from marsupial.bench.compare.statements import Experiment

PAPERS: Mapping[str, str] = {
    "wurm2010": "marsupial.bench.papers.wurm2010:EXPERIMENT",
    "wurm2008": "marsupial.bench.papers.wurm2008:EXPERIMENT",
    "alkhawaldah": "marsupial.bench.papers.alkhawaldah:EXPERIMENT",
    "mei": "marsupial.bench.papers.mei:EXPERIMENT",
}
"""Those of the command line: where they are."""

PARTS: Mapping[str, str] = {
    "alkhawaldah-weights": "marsupial.bench.papers.weights:EXPERIMENT",
    "mei-corner": "marsupial.bench.papers.mei:CORNER_EXPERIMENT",
}
"""Experiments that are parts of these."""


def experiment(name: str) -> Experiment | None:
    """Return the experiment, or part of one, of that name; None if there is none."""
    target = {**PAPERS, **PARTS}.get(name)
    found: Experiment | None = None if target is None else resolve_name(target)
    return found
