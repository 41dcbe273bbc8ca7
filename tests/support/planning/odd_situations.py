"""Random situations that are valid but unrealistic, for round trips through files."""

import numpy as np
from hypothesis import strategies as st

from marsupial.model import PlanningType, RobotState, Role, Situation, SituationGoal, TargetInfo

NAMES = st.one_of(
    st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), min_size=1, max_size=5),
    st.sampled_from(["home", "rover", "n-a", "n-", "a_type", "A_type", "carrier_type", "Room 1", "at", "t.5", "7"]),
)
TIMES = st.sampled_from([0, 0, 1, 2, 999, 1000, 123_456])


@st.composite
def odd_situations(draw: st.DrawFn) -> Situation:
    """Draw arbitrary travel tables and names, types without robots, and unusual numbers."""
    types = [
        PlanningType(name=name, role=role, capacity=draw(st.integers(0, 2)), dock_ms=draw(TIMES), undock_ms=draw(TIMES))
        for name, role in zip(
            draw(st.lists(NAMES, min_size=1, max_size=4, unique=True)),
            draw(st.lists(st.sampled_from(Role), min_size=4, max_size=4)),
            strict=False,
        )
    ]
    fresh = iter(draw(st.lists(NAMES, min_size=20, max_size=20, unique=True)))
    homes = [next(fresh) for _ in range(draw(st.integers(0, 2)))]
    robots: list[RobotState] = []
    for _ in range(draw(st.integers(0, 5))):
        robots.append(_robot(draw, types, robots, homes, next(fresh), next(fresh)))
    targets = [
        TargetInfo(
            name=next(fresh),
            explorers=frozenset(draw(st.lists(st.sampled_from([kind.name for kind in types])))),
            reveal_m2=draw(st.floats(0, 1e15)),
        )
        for _ in range(draw(st.integers(0, 3)))
    ]
    meetings = [next(fresh) for _ in range(draw(st.integers(0, 2)))]
    size = sum(robot.place is not None for robot in robots) + len(targets) + len(meetings) + len(homes)
    entries = st.one_of(st.just(-1), TIMES)
    return Situation(
        types=tuple(types),
        robots=tuple(robots),
        targets=tuple(targets),
        meetings=tuple(meetings),
        homes=tuple(homes),
        travel_ms={
            kind.name: np.array(
                draw(st.lists(entries, min_size=size * size, max_size=size * size)), dtype=np.int64
            ).reshape(size, size)
            for kind in types
        },
        goal=SituationGoal(recover_rovers=draw(st.booleans()), return_home=draw(st.booleans())),
    )


def _robot(
    draw: st.DrawFn, types: list[PlanningType], others: list[RobotState], homes: list[str], name: str, start: str
) -> RobotState:
    kind = draw(st.sampled_from(types))
    capacity = {t.name: t.capacity for t in types if t.role is Role.CARRIER}
    roomy = [
        other.name
        for other in others
        if sum(robot.carrier == other.name for robot in others) < capacity.get(other.type, 0)
    ]
    on = draw(st.sampled_from([None, *roomy])) if kind.role is Role.ROVER else None
    return RobotState(
        name=name,
        type=kind.name,
        place=start if on is None else None,
        carrier=on,
        free_at_ms=draw(TIMES),
        home=draw(st.sampled_from([None, *homes])),
    )
