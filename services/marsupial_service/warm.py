"""Imported by the launcher of workers ahead of their use: loads the compiled code that analyses maps.

See `marsupial_service.jobs.warm`, which does so for planners.
"""

from __future__ import annotations

import json

from marsupial_service import analysis
from marsupial_service.demo import DEMOS
from marsupial_service.intake_map import read_map_state
from marsupial_service.settings import Limits

json.dumps(analysis.analysis(read_map_state(DEMOS["yard"].request(), Limits()), frozenset(analysis.INCLUDE)))
