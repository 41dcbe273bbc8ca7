"""Situations and missions whose robots have batteries."""

import random
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from support.planning.drawn_situations import situations

from marsupial.model import PlanningBattery, Role, Situation
from marsupial.model.situation import PlanningType, RobotState, SituationGoal, TargetInfo

ROVER = PlanningBattery(capacity_j=1000.0, stand_w=4.0, drive_w=12.0, charge_w=50.0)


def charged(
    situation: Situation, batteries: Mapping[str, PlanningBattery], *chargers: str, **charges_j: float
) -> Situation:
    """Return the situation with batteries by type, and `chargers` at the same spots as the places of these names."""
    places, rows = situation.places, list(range(len(situation.places)))
    rows += [places.index(name) for name in chargers]
    return replace(
        situation,
        types=tuple(replace(kind, battery=batteries.get(kind.name)) for kind in situation.types),
        robots=tuple(replace(robot, charge_j=charges_j.get(robot.name)) for robot in situation.robots),
        chargers=tuple(f"charge_{name}" for name in chargers),
        travel_ms={kind: table[np.ix_(rows, rows)] for kind, table in situation.travel_ms.items()},
    )


def scattered(seed: int, capacity_j: float, carriers: int = 1) -> Situation:
    """Return two rovers per carrier, six targets and four meetings scattered over 50 m; all rovers end aboard."""
    draw = random.Random(seed)
    robots, names = [], []
    for i in range(carriers):
        robots.append(RobotState(name=f"c{i}", type="carrier", place=f"c{i}_start"))
        robots += [RobotState(name=f"r{i}_{k}", type="rover", carrier=f"c{i}") for k in range(2)]
        names.append(f"c{i}_start")
    explorers = [frozenset({"rover"} if draw.random() < 0.7 else {"carrier", "rover"}) for _ in range(6)]
    targets = [TargetInfo(name=f"t{i}", explorers=kinds) for i, kinds in enumerate(explorers)]
    meetings = tuple(f"m{i}" for i in range(4))
    names += [*(target.name for target in targets), *meetings]
    at = np.array([(draw.random() * 50, draw.random() * 50) for _ in names])
    metres = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1))
    tables = {"carrier": np.rint(1000 * metres).astype(np.int64), "rover": np.rint(2000 * metres).astype(np.int64)}
    for target in targets:
        if "carrier" not in target.explorers:
            i = names.index(target.name)
            tables["carrier"][i, :] = tables["carrier"][:, i] = -1
    return Situation(
        types=(
            PlanningType(name="carrier", role=Role.CARRIER, capacity=2),
            PlanningType(
                name="rover",
                role=Role.ROVER,
                dock_ms=10_000,
                undock_ms=5_000,
                battery=replace(ROVER, capacity_j=capacity_j),
            ),
        ),
        robots=tuple(robots),
        targets=tuple(targets),
        meetings=meetings,
        travel_ms=tables,
        goal=SituationGoal(recover_rovers=True),
    )


def waits_for_a_carrier() -> Situation:
    """Return: slow c2 can't fetch r2 where it ends, and c1 can only once it has charged after its own way.

    c1 and c2 start at the charging place; c2 has little charge and carries r2, for the target tr.
    """
    at = {"s1": (0, 0), "s2": (0, 0), "s3": (0, 0), "ta": (75, 15), "tb": (20, -86), "tc": (24, -90), "tr": (21, 24)}
    points = np.array([*at.values(), (42, 12), (24, 0)])
    metres = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    tables = {
        kind: np.rint(slowness * 1000 * metres).astype(np.int64) for kind, slowness in (("carrier", 1), ("slow", 2))
    }
    for table in tables.values():
        table[6, :] = table[:, 6] = -1
    carriers = frozenset(tables)
    situation = Situation(
        types=(
            *(PlanningType(name=name, role=Role.CARRIER, capacity=1) for name in tables),
            PlanningType(name="rover", role=Role.ROVER, dock_ms=10_000, undock_ms=5_000),
        ),
        robots=(
            RobotState(name="c1", type="carrier", place="s1"),
            RobotState(name="c2", type="slow", place="s2"),
            RobotState(name="r2", type="rover", carrier="c2"),
            RobotState(name="c3", type="carrier", place="s3"),
        ),
        targets=(
            *(TargetInfo(name=name, explorers=carriers) for name in ("ta", "tb", "tc")),
            TargetInfo(name="tr", explorers=frozenset({"rover"})),
        ),
        meetings=("m2", "m1"),
        travel_ms={**tables, "rover": np.rint(2000 * metres).astype(np.int64)},
    )
    large = PlanningBattery(capacity_j=16_000.0, stand_w=20.0, drive_w=80.0, charge_w=400.0)
    batteries = {"carrier": large, "slow": large, "rover": replace(ROVER, capacity_j=2500.0)}
    return charged(situation, batteries, "s1", c2=7800.0)


def within_range(situation: Situation) -> bool:
    """Return whether a full battery suffices for each target, from and to the nearest meetings without any wait."""
    kind = situation.type_by_name["rover"]
    assert kind.battery is not None

    def least_s(target: str) -> float:
        ways = [
            (situation.travel("rover", m, target), situation.travel("rover", target, m)) for m in situation.meetings
        ]
        return (min(out for out, _ in ways if out) + min(back for _, back in ways if back)) / 1000

    docking_j = kind.battery.stand_w * (kind.dock_ms + kind.undock_ms) / 1000
    needed = [kind.battery.drive_w * least_s(t.name) + docking_j for t in situation.targets if len(t.explorers) == 1]
    return max(needed, default=0.0) <= kind.battery.capacity_j


def _drawn_battery(draw: st.DrawFn, most_w: int) -> PlanningBattery:
    watts = st.integers(0, most_w)
    stand_w = draw(watts)
    return PlanningBattery(
        capacity_j=draw(st.integers(1, 200)) / 1000,
        stand_w=stand_w,
        drive_w=stand_w + draw(watts),
        charge_w=draw(watts),
    )


@st.composite
def charged_situations(draw: st.DrawFn) -> Situation:
    """Draw a situation with batteries of some types, and some charging places."""
    situation = draw(situations())
    drawn = {kind: _drawn_battery(draw, 8) for kind in ("carrier", "rover") if draw(st.booleans())}
    spots = (*situation.meetings, *situation.homes)
    return charged(situation, drawn, *(name for name in spots if draw(st.booleans())))
