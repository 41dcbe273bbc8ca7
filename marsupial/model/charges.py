"""The charges of a team's batteries, computed from what its robots do.

`marsupial.model.situation.PlanningBattery` has the rules. A charge is kept as of the moment when its robot, or one with
which it shares charge, began what it does now (`TeamCharges.settle`). What is asked in between is computed from there
and changes nothing: two worlds in which the same happens have the same charges to the last bit.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from marsupial.model.robots import Battery, RobotType


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryUse:
    """What a robot does that changes the charge of its battery."""

    driving_ms: int  # how long it has driven so far
    distance_m: float  # how far
    charging: bool = False  # whether it is aboard, or stands at a charging place
    lost: bool = False  # whether it is off
    # when it can take a new command, and the drive until then
    free_at_ms: int = 0
    step_ms: int = 0
    step_m: float = 0.0


@dataclass(slots=True)
class _Level:
    """The charge of a battery at a time, and how long and how far its robot had driven by then."""

    battery: Battery
    share: float = 1.0  # of its capacity
    at_ms: int = 0
    driving_ms: int = 0
    distance_m: float = 0.0


class TeamCharges:
    """The charge of each battery of a team, full at first, as a share of its capacity; below 0 once it is empty.

    `kinds` has the robots' types, by name; `use` tells what a robot does now, and `carrier_of` which carrier a rover is
    aboard, None while it docks.
    """

    def __init__(
        self,
        kinds: Mapping[str, RobotType],
        use: Callable[[str], BatteryUse],
        carrier_of: Callable[[str], str | None],
    ) -> None:
        self._kinds = kinds
        self._use = use
        self._carrier_of = carrier_of
        self._levels = {name: _Level(kind.battery) for name, kind in kinds.items() if kind.battery is not None}

    @property
    def robots(self) -> Iterable[str]:
        """The robots that have a battery."""
        return self._levels

    def share(self, robot: str, t_ms: int) -> float:
        """Return the charge of a robot at a time after all that was settled."""
        level, use, kind = self._levels[robot], self._use(robot), self._kinds[robot]
        past_s = 0.0 if use.lost else (t_ms - level.at_ms) / 1000
        if use.charging:
            return min(1.0, level.share + level.battery.charge_w * past_s / level.battery.capacity_j)
        # what a robot reports of its drives may also become less
        drove_ms, drove_m = max(0, use.driving_ms - level.driving_ms), max(0.0, use.distance_m - level.distance_m)
        used_j = kind.power_w(driving=False) * past_s + _driving_j(kind, drove_ms, drove_m)
        for rover in self._aboard(robot):
            used_j += (self.share(rover, t_ms) - self._levels[rover].share) * self._levels[rover].battery.capacity_j
        return level.share - used_j / level.battery.capacity_j

    def given_w(self, robot: str, t_ms: int) -> float:
        """Return the power with which a robot charges the rovers aboard it."""
        return sum(self._levels[rover].battery.charge_w for rover in self._aboard(robot) if self.share(rover, t_ms) < 1)

    def reported(self, robot: str, t_ms: int) -> float:
        """Return the charge for the report of a robot (`RobotReport.charge`)."""
        use, kind, battery = self._use(robot), self._kinds[robot], self._levels[robot].battery
        ahead_s, ahead_j = max(0, use.free_at_ms - t_ms) / 1000, 0.0
        if not use.charging:
            ahead_j = kind.power_w(driving=False) * ahead_s + _driving_j(kind, use.step_ms, use.step_m)
        return max(0.0, self.share(robot, t_ms) - ahead_j / battery.capacity_j)

    def settle(self, t_ms: int, *robots: str) -> None:
        """Bring charges up to date before robots begin something else."""
        if not self._levels:
            return
        coupled = dict.fromkeys(one for robot in robots for one in self._coupled(robot) if one in self._levels)
        for name, share in [(name, self.share(name, t_ms)) for name in coupled]:
            level, use = self._levels[name], self._use(name)
            level.share, level.at_ms, level.driving_ms, level.distance_m = share, t_ms, use.driving_ms, use.distance_m

    def resume(self, t_ms: int, robot: str) -> None:
        """Go on from the charge that a robot had when it was lost."""
        if robot in self._levels:
            self._levels[robot].at_ms = t_ms

    def correct(self, t_ms: int, robot: str, share: float) -> None:
        """Set the charge that a robot has now."""
        self.settle(t_ms, robot)
        self._levels[robot].share = share

    def _coupled(self, robot: str) -> list[str]:
        """Return the robots that share charge with one, it among them: a carrier and the rovers aboard."""
        carrier = self._carrier_of(robot) or robot
        return [robot, carrier, *self._aboard(carrier)]

    def _aboard(self, carrier: str) -> list[str]:
        """Return the rovers with a battery aboard a carrier."""
        rovers = self._levels if self._kinds[carrier].capacity else ()
        return [name for name in rovers if self._carrier_of(name) == carrier]


def _driving_j(kind: RobotType, driving_ms: int, distance_m: float) -> float:
    """Return the energy of a drive in addition to standing."""
    return kind.energy.drive_w * driving_ms / 1000 + kind.energy.metre_j * distance_m
