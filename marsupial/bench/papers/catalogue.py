"""The experiments that can be carried out again, by name."""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.bench.compare.statements import Experiment
from marsupial.bench.papers import alkhawaldah, mei, weights, wurm2008, wurm2010

PAPERS: Mapping[str, Experiment] = {
    wurm2010.NAME: wurm2010.EXPERIMENT,
    wurm2008.NAME: wurm2008.EXPERIMENT,
    alkhawaldah.NAME: alkhawaldah.EXPERIMENT,
    weights.NAME: weights.EXPERIMENT,
    mei.NAME: mei.EXPERIMENT,
    mei.CORNER: mei.CORNER_EXPERIMENT,
}
"""Those of the command line, and their parts."""


def paper_names() -> tuple[str, ...]:
    """Return the names of the papers, parts of experiments left out."""
    parts = {name for experiment in PAPERS.values() for name in experiment.parts.values()}
    return tuple(name for name in PAPERS if name not in parts)
