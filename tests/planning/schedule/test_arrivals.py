import pytest
from support.planning.situations import in_flight, one_room, relay

from marsupial.planning.schedule.costs import NEVER, Costs
from marsupial.planning.schedule.insertions import Arrivals
from marsupial.planning.schedule.timeline import Timeline, Transport, follow, transport


def test_robots_on_the_ground_arrive_by_themselves() -> None:
    situation = in_flight()
    known = Arrivals(Timeline.of(situation), Costs(situation))
    assert known.arrive_ms[0].tolist() == [17_001]  # the carrier, busy till 7 s, 10 s away
    assert known.arrive_ms[1].tolist() == [NEVER]  # a rover aboard does not drive
    assert known.aboard.tolist() == [0, -1]


def test_a_full_carrier_is_ready_for_another_rover_after_setting_one_down() -> None:
    situation = one_room()
    timeline = Timeline.of(situation)
    known = Arrivals(timeline, Costs(situation))
    assert known.boarding_ms.tolist() == [[[15_002]]]
    timeline.undock("r1", "m1")
    assert known.advance(timeline) == [0, 1]
    assert known.boarding_ms.tolist() == [[[15_002]]]
    assert known.arrive_ms.tolist() == [[15_002], [15_002]]
    assert known.aboard.tolist() == [-1]


def test_a_relay_is_found() -> None:
    situation = relay()
    known = Arrivals(Timeline.of(situation), Costs(situation))
    times, transports = known.relay(known.row["r1"])
    assert times.tolist() == [15_002, 35_003, 70_006]
    assert transports[2] == Transport(carrier="c2", pickup="m2", set_down="m3", then_to="m3")
    assert transports[1] == Transport(carrier="c1", pickup=None, set_down="m1", then_to="m2")


def test_alone_a_rover_gets_where_its_carrier_and_its_wheels_take_it() -> None:
    situation = relay()
    known = Arrivals(Timeline.of(situation), Costs(situation))
    times, _ = known.relay(known.row["r1"], alone=True)
    assert times.tolist()[:2] == [15_002, 35_003]
    assert times[2] >= NEVER


def test_following_the_rides_brings_the_rover_there_in_time() -> None:
    situation = relay()
    timeline = Timeline.of(situation)
    known = Arrivals(timeline, Costs(situation))
    times, transports = known.relay(known.row["r1"])
    assert follow(timeline, "r1", 2, transports)
    assert (timeline.at["r1"], timeline.ready_ms["r1"]) == ("m3", int(times[2]))


@pytest.mark.parametrize("meeting", ["m2", "m3"])
def test_an_impossible_transport_raises(meeting: str) -> None:
    timeline = Timeline.of(relay())
    assert not transport(timeline, "r1", Transport(carrier="c1", pickup=None, set_down=meeting, then_to="m3"))
