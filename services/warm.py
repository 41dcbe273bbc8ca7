"""Imported by the launcher of workers ahead of their use: loads the compiled code that analyses maps.

See `services.jobs.warm`, which does so for planners.
"""

from __future__ import annotations

import json

from services import analysis
from services.demo import DEMOS
from services.intake_map import read_map_state
from services.settings import Limits

json.dumps(analysis.analysis(read_map_state(DEMOS["yard"].request(), Limits()), frozenset(analysis.INCLUDE)))
