"""Scenario files: the documented format of a mission's world, team and goal (``docs/scenario-format.md``).

Reading reports all wrong fields at once. Writing is all or nothing, and a written file reads back as the same scenario.
"""

from marsupial.formats.scenario.read import is_scenario_file, is_scenario_text, read_scenario, read_scenario_and_map
from marsupial.formats.scenario.team import with_team
from marsupial.formats.scenario.write import scenario_text, write_scenario

__all__ = [
    "is_scenario_file", "is_scenario_text", "read_scenario", "read_scenario_and_map", "scenario_text", "with_team",
    "write_scenario",
]  # fmt: skip
