"""Scenario files: the documented format of a mission's world, team and goal (``docs/scenario-format.md``).

Reading reports all wrong fields at once.
"""

from marsupial.formats.scenario.read import is_scenario_file, is_scenario_text, read_scenario, read_scenario_and_map
from marsupial.formats.scenario.team import with_team

__all__ = ["is_scenario_file", "is_scenario_text", "read_scenario", "read_scenario_and_map", "with_team"]
