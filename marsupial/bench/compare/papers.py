"""The papers whose experiments can be carried out again, by the name the command line uses."""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.bench.compare import wurm2010
from marsupial.bench.compare.statements import Experiment

PAPERS: Mapping[str, Experiment] = {wurm2010.NAME: wurm2010.EXPERIMENT}
