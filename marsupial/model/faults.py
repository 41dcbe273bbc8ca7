"""Faults: what goes wrong during a mission, as a scenario lists it.

A fault happens at a time, at random times, or when a robot first sees a place. The simulator carries faults out
(`marsupial.sim.faults`); the mission loop learns of them as it would from real robots, through `News` and reports.
"""

import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from marsupial.errors import Problem, ScenarioError
from marsupial.model.grid import Cell
from marsupial.model.robots import Role

HOUR_MS = 3_600_000

MOST_DRAWN = 100_000  # most faults that random series may give a mission


class FaultKind(StrEnum):
    """What happens."""

    LOST = "lost"  # a robot fails, with all rovers aboard
    RETURNS = "returns"  # a lost robot can act again, where it stands
    JOINS = "joins"  # a robot is absent until now
    SLOWS = "slows"  # a robot drives at a share of its type's speed from now on
    STUCK = "stuck"  # a robot's drive fails, and it can't act for a while
    DECLINES = "declines"  # a robot refuses its next command
    DOCKING_FAILS = "docking_fails"  # a robot's next docking or undocking fails at its end
    GROUND = "ground"  # the terrain of an area changes: a door closes or opens, ground turns out undrivable
    MISSED_CELLS = "missed_cells"  # sensors miss a share of the cells in view
    POSITION_NOISE = "position_noise"  # drives end beside their goals


FROM_START = frozenset({FaultKind.MISSED_CELLS, FaultKind.POSITION_NOISE})  # all the time, at no moment
OF_A_ROBOT = frozenset(FaultKind) - {FaultKind.GROUND} - FROM_START


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """One fault, or with `rate_per_h` a random series of them."""

    kind: FaultKind
    robot: str | None = None  # None for a robot drawn at random, for all robots, and for faults that are no robot's
    # when it happens: one of these, none for faults from the start
    at_ms: int | None = None
    rate_per_h: float | None = None
    seen: Cell | None = None
    role: Role | None = None  # a series without a robot draws from the robots of this role; None: from all
    seed: int = 1  # draws the times and robots of a series, missed cells and noise, with the seed of the mission
    # of the type's speed; of the cells in view that are missed; of a drive's length, the standard deviation of its end
    share: float = 1.0
    reported: bool = True  # whether a robot that slows says so
    for_ms: int = 0  # how long a robot is stuck
    # the corner cells of an area, lower left and upper right, both part of it, and its new terrain
    area: tuple[Cell, Cell] | None = None
    terrain: int = 0


def dated(faults: Iterable[Fault], roles: Mapping[str, Role], limit_ms: int, seed: int) -> Iterator[Fault]:
    """Yield the faults of a mission, in the order of the list, with random series drawn: faults before `limit_ms`.

    `roles` has the robots' roles by name, `seed` is the mission's. Raise `ScenarioError` if there are too many.
    """
    count = 0
    for fault in faults:
        rng = random.Random(f"{fault.seed} {seed}")
        if fault.rate_per_h is None:
            yield replace(fault, seed=rng.randrange(1 << 32))
            continue
        drawn = [name for name, role in roles.items() if fault.role in (None, role)]
        if fault.kind in OF_A_ROBOT and fault.robot is None and not drawn:
            continue  # the team has no such robots
        t_ms = 0.0
        while (t_ms := t_ms + rng.expovariate(fault.rate_per_h / HOUR_MS)) < limit_ms:
            count += 1
            if count > MOST_DRAWN:
                text = f"random series give over {MOST_DRAWN} faults before the time limit of {limit_ms / 1000:g} s"
                raise ScenarioError([Problem("faults", text)])
            robot = rng.choice(drawn) if fault.robot is None and fault.kind in OF_A_ROBOT else fault.robot
            yield replace(fault, at_ms=round(t_ms), rate_per_h=None, robot=robot)
