"""Scenario files: the one documented format that a mission's world, team and goal are written in.

``docs/scenario-format.md`` describes it. Reading reports every wrong field at once; writing is all or nothing, and
what was written reads back as the same scenario.
"""

from __future__ import annotations

from marsupial.formats.scenario.read import is_scenario_file, is_scenario_text, read_scenario, understand_scenario
from marsupial.formats.scenario.team import with_team
from marsupial.formats.scenario.write import scenario_text, write_scenario

__all__ = [
    "is_scenario_file",
    "is_scenario_text",
    "read_scenario",
    "scenario_text",
    "understand_scenario",
    "with_team",
    "write_scenario",
]
