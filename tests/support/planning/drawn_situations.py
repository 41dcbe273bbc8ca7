"""Small situations drawn by hypothesis, for tests of planning."""

from dataclasses import replace

from hypothesis import strategies as st
from support.planning.spots import Spot, carrier, rover, situation_of

from marsupial.model.robots import Role
from marsupial.model.seats import Seats
from marsupial.model.situation import UNREACHABLE, PlanningType, RobotState, Situation, SituationGoal


@st.composite
def situations(draw: st.DrawFn, *, goals: bool = True, relays: bool = True) -> Situation:
    """Draw a small situation with times of a few ms: two way travel, triangle inequality, not always solvable.

    Without `relays` there is a single hall, so that every carrier reaches every meeting.
    """
    capacity = draw(st.integers(0, 2))
    dock, undock = draw(st.integers(0, 4)), draw(st.integers(0, 4))
    types = (
        PlanningType(name="carrier", role=Role.CARRIER, capacity=capacity),
        PlanningType(name="rover", role=Role.ROVER, dock_ms=dock, undock_ms=undock),
    )
    halls, rooms = st.integers(0, 1 if relays else 0), st.integers(0, 2)
    where = st.integers(-7, 7)

    def spot(*kinds: str) -> Spot:
        zones = {kind: draw(halls if kind == "carrier" else rooms) for kind in kinds}
        return Spot(draw(where), zones, draw(where))

    kinds = st.sampled_from([("carrier",), ("rover",), ("rover",), ("carrier", "rover")])
    homes = {f"h{i}": spot("carrier") for i in range(draw(st.integers(0, 2)))}
    robots, starts, places = [], {}, {}
    for i in range(1, draw(st.integers(1, 3)) + 1):
        home = draw(st.sampled_from([None, *homes]))
        robots.append(carrier(i, free_at_ms=draw(st.integers(0, 3)), home=home))
        starts[f"c{i}_start"] = spot("carrier")
        places[f"c{i}"] = capacity
    for i in range(1, draw(st.integers(0, 4)) + 1):
        on = draw(st.sampled_from([None, *(c for c, free in places.items() if free)]))
        robots.append(rover(i, on, free_at_ms=draw(st.integers(0, 3))))
        if on is None:
            starts[f"r{i}_start"] = spot("rover")
        else:
            places[on] -= 1
    flags = st.booleans() if goals else st.just(False)
    return situation_of(
        robots,
        {f"t{i}": spot(*draw(kinds)) for i in range(draw(st.integers(0, 4)))},
        # some are too narrow for rovers
        {
            f"m{i}": spot("carrier", *(["rover"] if draw(st.integers(0, 4)) else []))
            for i in range(draw(st.integers(0, 4)))
        },
        starts,
        homes=homes,
        types=types,
        goal=SituationGoal(recover_rovers=draw(flags), return_home=draw(flags)),
    )


@st.composite
def mixed_teams(draw: st.DrawFn, *, seats: bool = True) -> Situation:
    """Draw a small situation of two carrier types and three rover types, with seats by type or without any."""
    times, where = st.integers(0, 4), st.integers(-7, 7)
    groups = ["rover", "climber"]

    def seat_map() -> Seats:
        named = draw(st.lists(st.sampled_from(groups), unique=True)) if seats else []
        return tuple((kind, draw(st.integers(0, 2))) for kind in named)

    carriers = {name: (draw(st.integers(0, 2)), seat_map()) for name in ("carrier", "hauler")}
    rovers = {"rover": "", "slow": "rover" if seats else "", "climber": ""}
    types = (
        *(PlanningType(name=n, role=Role.CARRIER, capacity=c, seats=s) for n, (c, s) in carriers.items()),
        *(
            PlanningType(name=n, role=Role.ROVER, dock_ms=draw(times), undock_ms=draw(times), seats_as=group)
            for n, group in rovers.items()
        ),
    )

    def spot(*kinds: str) -> Spot:
        rooms = draw(st.integers(0, 1))
        return Spot(draw(where), {kind: 0 if kind in carriers else rooms for kind in kinds}, draw(where))

    robots, starts, aboard = [], {}, {}
    for i in range(1, draw(st.integers(1, 2)) + 1):
        kind = draw(st.sampled_from(list(carriers)))
        robots.append(RobotState(name=f"c{i}", type=kind, place=f"c{i}_start", free_at_ms=draw(times)))
        starts[f"c{i}_start"], aboard[f"c{i}"] = spot(kind), (kind, [])
    for i in range(1, draw(st.integers(1, 3)) + 1):
        kind = draw(st.sampled_from(list(rovers)))
        group = rovers[kind] or kind
        on = draw(st.sampled_from([None, *aboard]))
        # aboard if there is a place
        if on is not None:
            (capacity, most), load = carriers[aboard[on][0]], aboard[on][1]
            if len(load) < capacity and (not most or load.count(group) < dict(most).get(group, 0)):
                load.append(group)
            else:
                on = None
        robots.append(RobotState(name=f"r{i}", type=kind, place=None if on else f"r{i}_start", carrier=on))
        if on is None:
            starts[f"r{i}_start"] = spot(kind)
    kinds = st.lists(st.sampled_from([*carriers, *rovers, *rovers]), min_size=1, unique=True)
    return situation_of(
        robots,
        {f"t{i}": spot(*draw(kinds)) for i in range(draw(st.integers(0, 3)))},
        {f"m{i}": spot(*carriers, *rovers) for i in range(draw(st.integers(1, 3)))},
        starts,
        types=types,
        goal=SituationGoal(recover_rovers=draw(st.booleans())),
    )


@st.composite
def with_closed_roads(draw: st.DrawFn) -> Situation:
    """Draw a situation with some one-way roads."""
    situation = draw(situations())
    closed = draw(st.lists(st.tuples(*[st.integers(0, len(situation.places) - 1)] * 2), max_size=12))
    tables = {name: table.copy() for name, table in situation.travel_ms.items()}
    for table in tables.values():
        for origin, place in closed:
            table[origin, place] = UNREACHABLE
    return replace(situation, travel_ms=tables)
