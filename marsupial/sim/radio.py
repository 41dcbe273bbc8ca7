"""Which robots are in contact: carriers, the rovers near them, and the rovers near rovers in contact.

A rover out of contact keeps what it sees (`SimulatedRobot.held`), and adds it to the known map once it is in contact
again.
"""

import math
from collections.abc import Collection, Mapping

import numpy as np

from marsupial.maps.territory import contact_range_cells
from marsupial.model import UNKNOWN, CellArray, RobotType
from marsupial.sim.motion import Motion, Rule, SimulatedRobot


def in_contact(robots: Collection[SimulatedRobot], ranges_cells: Mapping[str, float]) -> frozenset[str]:
    """Return the robots in contact; those without a range are always. Lost robots pass nothing on."""
    apart = {one.name: one for one in robots if one.name in ranges_cells and one.cell and one.partner is None}
    relays = [one.cell for one in robots if one.name not in apart and one.cell and not one.lost]
    while apart and relays:
        here = relays.pop()
        for one in [one for one in apart.values() if one.cell and math.dist(one.cell, here) <= ranges_cells[one.name]]:
            del apart[one.name]
            if one.cell and not one.lost:
                relays.append(one.cell)
    return frozenset(one.name for one in robots if one.name not in apart)


class Radio(Rule):
    """Notes which rovers are no longer in contact, and which are again; lost ones are found, but not lost again."""

    def __init__(self, motion: Motion, kinds: Mapping[str, RobotType]) -> None:
        self._motion = motion
        self._ranges = {
            name: contact_range_cells(robot.kind, kinds.values(), motion.grid.resolution_m)
            for name, robot in motion.team.items()
            if robot.kind.radio_range_m is not None
        }

    def on_moment(self) -> None:
        if not self._ranges:
            return
        heard = in_contact(self._motion.team.values(), self._ranges)
        for name in self._ranges:
            robot = self._motion.team[name]
            if robot.held is None and name not in heard and not robot.lost:
                robot.held = np.full_like(self._motion.known, UNKNOWN)
                self._motion.moment.out_of_contact.append(name)
            elif robot.held is not None and name in heard:
                self._hand_in(robot, robot.held)

    def _hand_in(self, robot: SimulatedRobot, held: CellArray) -> None:
        """Add what a rover has seen out of contact to the known map."""
        moment, truth = self._motion.moment, self._motion.truth.cells.ravel()
        known, seen = self._motion.known.ravel(), held.ravel()
        new = np.flatnonzero((seen != UNKNOWN) & (seen != known))
        fresh = new[known[new] == UNKNOWN]
        # others may have seen since how ground that it saw has changed
        changed = new[(known[new] != UNKNOWN) & (seen[new] == truth[new])]
        for cells in (fresh, changed):
            known[cells] = seen[cells]
        if len(fresh):
            moment.revealed.append((robot.name, fresh))
        self._motion.note_change(robot.name, changed)
        robot.held = None
        moment.in_contact.append(robot.name)
