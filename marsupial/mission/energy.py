"""The energy that robots have used in a mission."""

from __future__ import annotations

from collections.abc import Mapping

from marsupial.model.robots import RobotType
from marsupial.model.world import RobotReport, World


def energy_j(world: World, kinds: Mapping[str, RobotType]) -> tuple[tuple[str, float], ...]:
    """Return the energy in J that each robot has used so far."""

    def used(robot: RobotReport) -> float:
        energy, driving_s = kinds[robot.type].energy, world.driving_ms(robot.name) / 1000
        made = world.manoeuvres(robot.name)
        timed = energy.idle_w * (world.now_ms / 1000) + energy.drive_w * driving_s
        driven = energy.metre_j * world.distance_m(robot.name) + energy.stop_j * made.stops
        turned = sum(joules * times for joules, times in zip(energy.turn_j, made.turns, strict=True))
        return round(timed + driven + turned, 3)

    return tuple((robot.name, used(robot)) for robot in world.robots())
