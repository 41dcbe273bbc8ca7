"""Imported by the launcher of workers ahead of their use: loads the compiled code that analyses maps.

See `marsupial_service.jobs.warm`, which does so for planners.
"""

from __future__ import annotations

from marsupial_service import analysis
from marsupial_service.demo import DEMOS
from marsupial_service.intake_map import map_state_of
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.settings import ServiceLimits

_yard = map_state_of(MapStateBody.model_validate(DEMOS["yard"].load()), ServiceLimits())
analysis.analysis(_yard, frozenset(analysis.INCLUDE))
