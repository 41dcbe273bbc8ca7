"""What robots see: the known map grows by what is in view of a robot on the ground, and by what its body may touch.

From every cell that it passes a robot sees all cells in line of sight within its range, and senses those that its body
would touch one cell further on. One with a sensor angle sees only ahead while it drives; where it stands it turns on
the spot, which takes no time, and sees all around. What rovers out of contact see is held until they are in contact
again (`marsupial.sim.radio`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from marsupial.arrays import Ints
from marsupial.maps.footprint import Contact
from marsupial.model import UNKNOWN, Cell, CellArray, RobotType
from marsupial.model.faults import Fault, FaultKind
from marsupial.native import native
from marsupial.sim.motion import Motion, RobotActivity, Rule, SimulatedRobot
from marsupial.sim.sensors import Checked, FieldOfView, Sensor, ahead


class Sensing(Rule):
    """Lets robots look round, without a `sensor` by the exact field of view; `faults` may let cells be missed."""

    def __init__(
        self, motion: Motion, kinds: Mapping[str, RobotType], sensor: Sensor | None, faults: Sequence[Fault]
    ) -> None:
        self._motion = motion
        self._sensor = FieldOfView() if sensor is None else Checked(sensor)
        self._touch = {k.name: Contact(k, motion.grid.resolution_m) for k in kinds.values()}
        missed = [fault for fault in faults if fault.kind is FaultKind.MISSED_CELLS]
        self._misses = [(fault.share, np.random.default_rng(fault.seed)) for fault in missed]
        self._exact = sensor is None and not missed  # a second look by the same type from the same cell reveals nothing
        self._looks: set[tuple[str, Cell, int | None]] = set()  # type, cell, and where it looked
        self._changing = any(fault.kind is FaultKind.GROUND for fault in faults)

    def forget(self) -> None:
        """Let looks from the same cells reveal something again, as the ground has changed."""
        self._looks.clear()

    def look(self, robot: SimulatedRobot) -> None:
        assert robot.cell is not None
        kind, cell, heading = robot.kind, robot.cell, _heading_of(robot)
        if self._exact:
            look = kind.name, cell, heading
            if look in self._looks or (kind.name, cell, None) in self._looks:
                return
            if robot.held is None:
                self._looks.add(look)
        truth = self._motion.truth
        # known cells in view matter only where their ground may have changed, or where each may be missed
        known = None if self._changing or self._misses else self.map_of(robot)
        seen = self._sensor.visible(truth, kind, cell, known)
        if heading is not None and kind.sensor_angle_deg is not None:
            seen = ahead(seen, truth, cell, heading, kind.sensor_angle_deg)
        for share, rng in self._misses:
            seen = seen[rng.random(len(seen)) >= share]
        self.learn(robot, seen, self._touch[kind.name].touched(truth.cells, cell))

    def learn(self, robot: SimulatedRobot, seen: Ints, touched: Ints) -> None:
        """Add the cells (row-major indices) that a robot sees and touches to its map."""
        truth, known, moment = self._motion.truth.cells, self.map_of(robot), self._motion.moment
        if self._changing:
            noticed = np.union1d(seen, touched)
            differs = (known.ravel()[noticed] != UNKNOWN) & (known.ravel()[noticed] != truth.ravel()[noticed])
            changed = noticed[differs]
            known.ravel()[changed] = truth.ravel()[changed]
            if robot.held is None:
                self._motion.note_change(robot.name, changed)
        fresh = np.empty(len(seen) + len(touched), dtype=np.int64)
        count = _reveal(seen, truth, known, fresh)
        count += _reveal(touched, truth, known, fresh[count:])
        if count and robot.held is None:
            # sorted, as the log encodes runs of neighbouring cells
            moment.revealed.append((robot.name, np.sort(fresh[:count])))

    def map_of(self, robot: SimulatedRobot) -> CellArray:
        """Return the map that a robot adds to: the known one, or what it has seen since it was last in contact."""
        return self._motion.known if robot.held is None else robot.held


def _heading_of(robot: SimulatedRobot) -> int | None:
    """Return the heading to which a robot's view is limited; None if it sees all around."""
    driving = robot.activity is RobotActivity.DRIVING
    return robot.odometer.heading if driving and robot.kind.sensor_angle_deg is not None else None


@native
def _reveal(cells: Ints, truth: CellArray, known: CellArray, fresh: Ints) -> int:
    """Copy cells (row-major) from `truth` to `known`, write the new ones to `fresh`, and return their number."""
    codes, found = truth.ravel(), known.ravel()
    count = 0
    for index in cells:
        if found[index] == UNKNOWN:
            found[index] = codes[index]
            fresh[count] = index
            count += found[index] != UNKNOWN
    return count
