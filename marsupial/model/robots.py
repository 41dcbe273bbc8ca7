"""Robot types and team members: the abilities of each robot, and where it starts.

A `RobotType` has metres and seconds, as scenario files do. Planning works with integer milliseconds
(`marsupial.model.situation`).
"""

import math
from dataclasses import dataclass
from enum import StrEnum

from marsupial.model.grid import FLOOR, ROUGH, Cell
from marsupial.model.seats import Seats

SQRT2 = math.sqrt(2.0)


class Role(StrEnum):
    """The role of a robot type."""

    CARRIER = "carrier"
    ROVER = "rover"


class Routes(StrEnum):
    """Which routes robots take."""

    SHORTEST = "shortest"
    ENERGY = "energy"  # of least energy, by the energy model of the robot type


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyModel:
    """The energy use of a robot type: power by time, energy by distance and manoeuvre.

    References
    ----------
    Mei, Lu, Lee and Hu, Energy-Efficient Mobile Robot Exploration, ICRA 2006, section V-A.
    """

    # idle_w, drive_w: power in W at all times, and in addition while driving
    idle_w: float = 0.0
    drive_w: float = 0.0
    metre_j: float = 0.0  # energy in J per metre driven
    stop_j: float = 0.0  # energy in J per stop on the way: at each turn, and at each pause
    # energy in J per turn of 45, 90, 135 and 180 degrees
    turn_j: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Battery:
    """The battery of a robot type. A robot whose battery is empty fails.

    It charges at charging places (`Grid.chargers`), and that of a rover also aboard, from the battery of the carrier if
    that has one.
    """

    capacity_j: float
    charge_w: float = 0.0  # power with which it charges


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotType:
    """The abilities of robots of one type."""

    name: str
    role: Role
    speed_mps: float  #: driving speed in m/s
    sensor_range_m: float
    radius_m: float  #: radius of its footprint in metres; 0 is a point that only needs its own cell
    terrains: frozenset[int]  #: codes of the terrain classes it can drive on
    capacity: int = 0  #: carriers: number of rovers that it can carry. Rovers: 0.
    #: carriers: the most rovers of each type among them, others don't fit; empty: rovers of all types fit
    seats: Seats = ()
    dock_ms: int = 0  #: rovers: duration of docking on a carrier
    undock_ms: int = 0  #: rovers: duration of undocking from it
    energy: EnergyModel = EnergyModel()
    #: length of a diagonal step in straight steps: sqrt 2, or less, down to 1 in worlds where every move takes the same
    #: time
    diagonal: float = SQRT2
    routes: Routes = Routes.SHORTEST  #: which routes it takes; least energy only if driving uses energy (`driving_j`)
    battery: Battery | None = None  #: None has no limit
    #: angle of its view while it drives, half of it on each side of its heading; where it stands it turns and sees all
    #: around. None: all around everywhere.
    sensor_angle_deg: float | None = None
    #: rovers: how far from a carrier, or from a rover in contact, they are in contact; None: everywhere
    radio_range_m: float | None = None

    @property
    def driving_j(self) -> float:
        """Energy in J of driving a metre, in addition to standing."""
        return self.energy.metre_j + self.energy.drive_w / self.speed_mps

    def power_w(self, *, driving: bool, speed: float = 1.0) -> float:
        """Return the power in W that it uses on the ground, standing or driving at a share of its speed."""
        energy = self.energy
        return energy.idle_w + driving * (energy.drive_w + energy.metre_j * self.speed_mps * speed)

    @property
    def battery_fault(self) -> str | None:
        """The fault of `battery`, or None."""
        if self.battery is not None and (self.energy.stop_j or any(self.energy.turn_j)):
            return "plans know no energy of stops and turns (energy.stop_j, energy.turn_j), which must be 0"
        return None

    @property
    def routes_fault(self) -> str | None:
        """The fault of `routes`, or None."""
        if self.routes is Routes.ENERGY and not self.driving_j > 0:
            return "no way takes less energy than another: driving takes none (energy.metre_j, energy.drive_w)"
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamMember:
    """One robot of the team."""

    name: str
    type: str
    start: Cell | None = None  # its first cell; None for a carried rover, and if the seed draws the start
    carrier: str | None = None  # the carrier that it starts on (rovers only)


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
    """Return `carriers` carriers with `rovers` rovers aboard each: ``carrier1``, ``rover1_1``, ``rover1_2``..."""
    team: list[TeamMember] = []
    for i in range(1, carriers + 1):
        team.append(TeamMember(name=f"carrier{i}", type="carrier"))
        team += [TeamMember(name=f"rover{i}_{j}", type="rover", carrier=f"carrier{i}") for j in range(1, rovers + 1)]
    return tuple(team)
