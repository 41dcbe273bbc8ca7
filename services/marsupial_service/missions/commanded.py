"""A robot as the process of its mission knows it: from its reports, and from the commands that it was sent."""

from dataclasses import dataclass, field

from marsupial.model.charges import BatteryUse
from marsupial.model.grid import Cell
from marsupial.model.robots import RobotType
from marsupial.paths.routes import Odometer
from marsupial_service.missions.reported import ReportedRobot, RobotCommand


@dataclass(slots=True, kw_only=True)
class CommandedRobot(ReportedRobot[Cell]):
    """A robot as its reports and commands describe it."""

    kind: RobotType
    free_at_ms: int = 0
    order: RobotCommand | None = None
    failures: int = 0
    distance_m: float = 0.0
    driving_ms: int = 0
    odometer: Odometer = field(default_factory=Odometer)
    reported_ms: int = 0
    returns: bool = False  # whether it is expected to return once it is lost
    speed: float = 1.0  # share of its type's speed
    slowed: bool = False  # whether `speed` changed during its drive, since the last cell
    before_ms: int = 0  # how long it had driven before its drive, less when that began
    step_m: float = 0.0  # length of its way to its next cell that `distance_m` lacks
    behind: float = 0.0  # how much charge its reports have taken from the estimates since that last led to a plan

    @property
    def driving(self) -> bool:
        return self.order is not None and self.order.name == "drive"

    @property
    def cell(self) -> Cell | None:
        """The robot's cell; None while it is aboard."""
        return None if self.where.carrier is not None else self.where.at

    def advance(self, cell: Cell) -> None:
        """Count the turns of the route up to `cell`; off the route the robot's heading is unknown."""
        order = self.order
        if order is None or not order.route or cell == order.route[order.passed]:
            return
        if cell not in order.route[order.passed :]:
            self.odometer.heading = None
            return
        while order.route[order.passed] != cell:
            self.odometer.step(order.route[order.passed], order.route[order.passed + 1])
            order.passed += 1

    def step_cells(self) -> float:
        """Return the length of the step to its cell on its route, in cells; 0 if it is not driving on its route."""
        order = self.order
        if order is None or not order.passed or order.route[order.passed] != self.cell:
            return 0.0
        before, there = order.route[order.passed - 1 : order.passed + 1]
        return 1.0 if before.x == there.x or before.y == there.y else self.kind.diagonal

    def battery_use(self, *, at_charger: bool) -> BatteryUse:
        """Return what the robot does with its battery."""
        return BatteryUse(
            driving_ms=self.driving_ms,
            distance_m=self.distance_m,
            charging=self.where.aboard is not None or (at_charger and not self.driving),
            lost=self.lost,
            free_at_ms=self.free_at_ms,
            step_ms=max(0, self.before_ms + self.free_at_ms - self.driving_ms) if self.driving else 0,
            step_m=self.step_m,
        )
