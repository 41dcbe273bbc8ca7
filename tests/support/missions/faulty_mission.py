"""A small scenario with faults of all kinds, and its mission."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from support.missions.small_missions import Recorder

from marsupial.formats.scenario.read import read_scenario
from marsupial.library.metrics import Summary
from marsupial.library.missions import simulate
from marsupial.model import Budget, MissionEvent, Scenario

YARD = """
format: marsupial-scenario
version: 1
map:
  resolution_m: 0.5
  rows:
    - "##############################"
    - "#........#~~~~~~~~~#.........#"
    - "#........#~~~~~~~~~#.........#"
    - "#........~~~~~~~~~~#.........#"
    - "#........#~~~~~~~~~#.........#"
    - "#........###########.........#"
    - "#............................#"
    - "#........#~~~~~~~~~#.........#"
    - "#........~~~~~~~~~~#.........#"
    - "#........#~~~~~~~~~#.........#"
    - "##############################"
robot_types:
  - {name: carrier, role: carrier, speed_mps: 1, sensor_range_m: 4, radius_m: 0.4, terrains: [floor], capacity: 2}
  - {name: rover, role: rover, speed_mps: 0.5, sensor_range_m: 3, radius_m: 0.1, terrains: [floor, rough],
     dock_s: 10, undock_s: 5}
team:
  - {name: c1, type: carrier, start: [1.75, 1.25]}
  - {name: r1, type: rover, carrier: c1}
  - {name: r2, type: rover, carrier: c1}
  - {name: c2, type: carrier, start: [2.75, 3.25]}
  - {name: r3, type: rover, carrier: c2}
"""
FAULTS = """
faults:
  - {fault: slows, robot: c1, at_s: 3, speed_share: 0.5}
  - {fault: slows, robot: r1, at_s: 8, speed_share: 0.8}
  - {fault: stuck, robot: c2, at_s: 4, for_s: 12}
  - {fault: declines, robot: r1, at_s: 0}
  - {fault: docking_fails, robot: r1, at_s: 0}
  - {fault: lost, robot: r3, at_s: 10}
  - {fault: returns, robot: r3, at_s: 14}
  - {fault: ground, area_m: [4.6, 2.1, 5.3, 2.4], terrain: obstacle, at_s: 12}
  - {fault: ground, area_m: [4.6, 2.1, 5.3, 2.4], terrain: floor, at_s: 45}
  - {fault: missed_cells, share: 0.05}
  - {fault: position_noise, robot: c2, share: 0.05}
  - {fault: stuck, rate_per_h: 100, for_s: 3, seed: 2}
"""


def yard(faults: str = FAULTS, *, interference: bool = False) -> Scenario:
    """Return the scenario with these faults."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "yard.yaml")
        path.write_text(YARD + faults + ("interference: true\n" if interference else ""))
        return read_scenario(path)


def explored(scenario: Scenario, strategy: str = "temporal", steps: int = 1) -> tuple[Summary, Sequence[MissionEvent]]:
    """Explore a scenario with the greedy planner."""
    recorder = Recorder()
    budget = Budget(steps=steps)
    summary = simulate(scenario, strategy=strategy, planner="greedy", budget=budget, seed=1, observer=recorder)
    return summary, tuple(recorder.events)
