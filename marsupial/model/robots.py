"""Robot types and the team: what each robot is able to do.

A robot type holds metres and seconds, as scenario files do; planning works on integer milliseconds
(`marsupial.model.situation`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from marsupial.model.grid import FLOOR, ROUGH, Cell

SQRT2 = math.sqrt(2.0)


class Role(StrEnum):
    """What a robot type is for."""

    CARRIER = "carrier"
    ROVER = "rover"


class Routes(StrEnum):
    """Which of the ways to a place robots take."""

    SHORTEST = "shortest"
    ENERGY = "energy"
    """Those of least energy, by the energy model of their type."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyModel:
    """What a robot type uses: power by time, and energy by distance and manoeuvre.

    Parameters
    ----------
    idle_w, drive_w
        Power in W drawn always, and on top of it while driving.
    metre_j
        Energy in J per metre driven.
    stop_j
        Energy in J per stop on the way: wherever it turns, or stands before it goes on.
    turn_j
        Energy in J per turn of 45, 90, 135 and 180 degrees.

    References
    ----------
    Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, section V-A.
    """

    idle_w: float = 0.0
    drive_w: float = 0.0
    metre_j: float = 0.0
    stop_j: float = 0.0
    turn_j: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotType:
    """Abilities shared by robots of one type.

    Parameters
    ----------
    speed_mps
        Driving speed in m/s.
    sensor_range_m
        How far it sees, in metres.
    radius_m
        Radius of its footprint in metres; 0 is a point that only needs its own cell.
    terrains
        Codes of the terrain classes it can drive on.
    capacity
        Carriers: how many rovers it carries. Rovers: 0.
    dock_ms, undock_ms
        Rovers: how long docking on a carrier and undocking from it take. Carriers: 0.
    diagonal
        How long a diagonal step is in straight ones: sqrt 2, or down to 1 where robots hop from cell to cell and each
        move takes as long as any other.
    routes
        Which ways it takes; those of least energy only if driving takes it some (`driving_j`).
    """

    name: str
    role: Role
    speed_mps: float
    sensor_range_m: float
    radius_m: float
    terrains: frozenset[int]
    capacity: int = 0
    dock_ms: int = 0
    undock_ms: int = 0
    energy: EnergyModel = EnergyModel()
    diagonal: float = SQRT2
    routes: Routes = Routes.SHORTEST

    @property
    def driving_j(self) -> float:
        """Energy in J of driving a metre, beyond what is used anyway."""
        return self.energy.metre_j + self.energy.drive_w / self.speed_mps

    @property
    def routes_fault(self) -> str | None:
        """What is wrong with the ways it takes, or None."""
        if self.routes is Routes.ENERGY and not self.driving_j > 0:
            return "no way takes less energy than another: driving takes none (energy.metre_j, energy.drive_w)"
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamMember:
    """One robot of the team.

    Parameters
    ----------
    start
        Its first cell; None for a carried rover and for robots whose start is drawn by the seed.
    carrier
        Name of the carrier it starts docked on (rovers only).
    """

    name: str
    type: str
    start: Cell | None = None
    carrier: str | None = None


def default_types(capacity: int) -> tuple[RobotType, RobotType]:
    """Return the carrier and rover types used for a bare map; the carrier has `capacity` places."""
    carrier = RobotType(
        name="carrier",
        role=Role.CARRIER,
        speed_mps=1.0,
        sensor_range_m=10.0,
        radius_m=0.5,
        terrains=frozenset({FLOOR}),
        capacity=capacity,
        energy=EnergyModel(idle_w=20.0, drive_w=60.0),
    )
    rover = RobotType(
        name="rover",
        role=Role.ROVER,
        speed_mps=0.5,
        sensor_range_m=5.0,
        radius_m=0.15,
        terrains=frozenset({FLOOR, ROUGH}),
        dock_ms=10_000,
        undock_ms=5_000,
        energy=EnergyModel(idle_w=4.0, drive_w=8.0),
    )
    return carrier, rover


def uniform_team(carriers: int, rovers: int) -> tuple[TeamMember, ...]:
    """Return `carriers` carriers with `rovers` docked rovers each: ``carrier1``, ``rover1_1``, ``rover1_2``..."""
    team: list[TeamMember] = []
    for i in range(1, carriers + 1):
        team.append(TeamMember(name=f"carrier{i}", type="carrier"))
        team += [TeamMember(name=f"rover{i}_{j}", type="rover", carrier=f"carrier{i}") for j in range(1, rovers + 1)]
    return tuple(team)
