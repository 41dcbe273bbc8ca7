"""Zones of an operator: nobody enters a no-go zone, only the area to explore is explored, priorities come first."""

import json

import numpy as np
import pytest
from support.missions.faulty_mission import explored, yard
from support.missions.small_teams import CORRIDOR, carrier_at, drawn_grid, kinds_of
from support.missions.zone_rules import trespasses

from marsupial.errors import ScenarioError
from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.formats.scenario.team import with_team
from marsupial.formats.scenario.zones import zone_fields, zone_in
from marsupial.mission.belief.belief import Belief
from marsupial.mission.rebuild import moment_at
from marsupial.model import ActionName, Grid, News
from marsupial.model.mission import ActionStarted, Cause, DriveEnded, Planned, Revealed, Status, ZoneChanged
from marsupial.model.runs import cells_in
from marsupial.model.zones import DatedZone, Zone, ZoneChange, ZoneKind, covered
from marsupial.sim.world import SimulatedWorld
from marsupial.strategies.registry import RULES

WEST, EAST = "[[0, 0], [4, 0], [4, 6], [0, 6]]", "[[9, 0], [11, 0], [11, 6], [9, 6]]"
LATER = f"zones: [{{name: east, kind: no_go, polygon_m: {EAST}, from_s: 6}}]\n"
CAUGHT = f"zones: [{{name: west, kind: no_go, polygon_m: {WEST}, from_s: 2}}]\n"
AREA = "zones: [{name: area, kind: explore, polygon_m: [[0, 0], [7, 0], [7, 6], [0, 6]]}]\n"
LEADERS = ("temporal", "heuristic", "heuristic-plus", "assignment", "wurm2010")


def test_a_polygon_covers_the_cells_whose_centres_lie_in_it() -> None:
    grid = Grid(cells=np.ones((4, 4), dtype=np.uint8), resolution_m=0.5, origin_m=(1.0, 2.0, 0.0))
    corner = covered(grid, ((1.0, 2.0), (2.0, 2.0), (1.0, 3.0)))
    assert corner.tolist()[:2] == [[True, False, False, False], [False] * 4]
    whole, hole = (-9.0, -9.0), (9.0, 9.0)
    assert covered(grid, (whole, (9.0, -9.0), hole, (-9.0, 9.0))).all()
    turned = Grid(cells=grid.cells, resolution_m=1.0, origin_m=(0.0, 0.0, np.pi / 2))
    assert covered(turned, ((-2.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-2.0, 1.0))).nonzero()[1].tolist() == [0, 0]


@pytest.mark.parametrize("strategy", LEADERS)
@pytest.mark.parametrize("zones", [LATER, CAUGHT, f"{CAUGHT}interference: true\n"])
def test_nobody_enters_a_no_go_zone_and_robots_inside_leave(zones: str, strategy: str) -> None:
    scenario = yard(zones)
    _, events = explored(scenario, strategy)
    assert not list(trespasses(scenario.grid, events))
    (change,) = [event for event in events if isinstance(event, ZoneChanged)]
    causes = [
        trigger.cause for e in events if isinstance(e, Planned) and e.t_ms == change.t_ms for trigger in e.trigger
    ]
    assert Cause.ZONES in causes
    end = events[-1]
    assert end.status is Status.COMPLETE
    assert set(end.aboard) == {"r1", "r2", "r3"}
    if zones is LATER:
        assert end.reason == "no reachable target is left, all rovers are aboard; no-go zones: east"
    else:  # the whole team was caught, and explored the rest
        assert end.coverage == 1.0


def test_a_robot_that_misses_its_goal_does_not_dock_in_a_no_go_zone() -> None:
    corners = "[[4, 4], [7, 4], [7, 7], [4, 7]]"
    noise = "faults: [{fault: position_noise, share: 0.5, seed: 25}]\n"
    scenario = yard(f"zones: [{{name: south, kind: no_go, polygon_m: {corners}, from_s: 6}}]\n{noise}")
    _, events = explored(scenario, "heuristic-plus")
    zone = covered(scenario.grid, tuple(map(tuple, json.loads(corners))))
    at, inside, ended_inside = {}, False, 0
    for event in events:
        inside = inside or isinstance(event, ZoneChanged)
        if isinstance(event, DriveEnded):
            at[event.robot] = event.cell
            ended_inside += inside and zone[event.cell.y, event.cell.x]
        if isinstance(event, ActionStarted) and event.action.carrier is not None and inside:
            outside = event.action.robots if event.action.name is ActionName.DOCK else event.action.robots[1:]
            assert not any(zone[at[name].y, at[name].x] for name in outside if name in at), event
    assert ended_inside  # otherwise nothing was tried


@pytest.mark.parametrize("strategy", RULES)
def test_rules_without_rovers_keep_to_zones(strategy: str) -> None:
    carriers = 1 if strategy in ("orientation", "widest-frontier") else 2
    scenario = with_team(yard(CAUGHT), carriers, 0)
    _, events = explored(scenario, strategy)
    assert not list(trespasses(scenario.grid, events))
    assert (events[-1].status, events[-1].coverage) == (Status.COMPLETE, 1.0)


@pytest.mark.parametrize("strategy", LEADERS)
def test_only_the_area_to_explore_is_explored(strategy: str) -> None:
    scenario = yard(AREA)
    _, events = explored(scenario, strategy)
    end = events[-1]
    assert (end.status, end.coverage) == (Status.COMPLETE, 1.0)
    assert {left.reason for left in end.remaining} == {"outside the area to explore"}
    assert end.t_ms < explored(yard(""), strategy)[1][-1].t_ms


def test_a_zone_that_ends_gives_its_ground_free() -> None:
    scenario = yard(f"zones: [{{name: east, kind: no_go, polygon_m: {EAST}, until_s: 15}}]\n")
    _, events = explored(scenario)
    assert not list(trespasses(scenario.grid, events))
    assert (events[-1].status, events[-1].coverage) == (Status.COMPLETE, 1.0)


def test_robots_go_to_a_priority_zone_first() -> None:
    scenario = yard("")
    room = covered(scenario.grid, ((5.0, 3.0), (9.5, 3.0), (9.5, 5.5), (5.0, 5.5))).ravel()

    def seen_ms(zones: str) -> int:
        """Return when the last cell of a room is seen."""
        _, events = explored(yard(zones), steps=5)
        looks = [event for event in events if isinstance(event, Revealed)]
        return max(look.t_ms for look in looks if room[cells_in(look.runs)[0]].any())

    corners = "[[5, 3], [9.5, 3], [9.5, 5.5], [5, 5.5]]"
    assert seen_ms(f"zones: [{{name: room, kind: priority, weight: 20, polygon_m: {corners}}}]\n") < seen_ms("")


def test_the_log_has_the_raw_map_and_gives_the_situation_with_zones() -> None:
    scenario = yard(LATER)
    _, events = explored(scenario)
    assert parse_log("".join(f"{line}\n" for line in log_lines(events)).encode()).events == events
    line = next(json.loads(line) for line in log_lines(events) if '"zone"' in line)
    assert (line["event"], line["name"], line["zone"]["kind"]) == ("zone", "east", "no_go")
    known = moment_at(events, events[-1].t_ms)
    assert np.array_equal(known.grid.cells[known.grid.cells != 255], scenario.grid.cells[known.grid.cells != 255])
    planned = next(event for event in events if isinstance(event, Planned) and event.t_ms > 6000)
    assert [t.name for t in moment_at(events, planned.t_ms).survey().situation.targets] == [
        target.name for target in planned.targets
    ]


def test_a_team_that_a_zone_keeps_from_its_home_says_so() -> None:
    wall = "zones: [{name: wall, kind: no_go, polygon_m: [[4, 0], [5, 0], [5, 6], [4, 6]], from_s: 8}]\n"
    scenario = yard(f"{wall}goal: {{return_home: true}}\n")
    _, events = explored(scenario)
    assert not list(trespasses(scenario.grid, events))
    end = events[-1]
    assert end.status is Status.STALLED
    assert "c2 has no path to its home h_c2" in end.reason
    assert end.reason.endswith("no-go zones: wall")
    standing = [event for event in events if isinstance(event, DriveEnded) and event.robot == "c1"]
    assert standing[-1].cell == (3, 2), "it was caught on its way and left the zone towards its home"


def test_a_longer_way_home_calls_the_team_back_sooner() -> None:
    detour = "zones: [{name: gate, kind: no_go, polygon_m: [[4, 2.5], [10, 2.5], [10, 3.5], [4, 3.5]], from_s: 18}]\n"
    for zones in ("", detour):
        _, events = explored(yard(f"{zones}goal: {{return_home: true}}\nlimits: {{time_s: 40}}\n"))
        assert "is not home" not in events[-1].reason or "no-go zones" in events[-1].reason


WRONG = [
    ("{name: a, kind: nogo, polygon_m: [[0, 0], [1, 0], [1, 1]]}", "kind: must be no_go or priority or explore"),
    ("{name: a, kind: no_go, polygon_m: [[0, 0], [1, 0]]}", "polygon_m: must have 3 to 1000 corners, has 2"),
    ("{name: a, kind: no_go, polygon_m: [[0, 0], [1, 0], [1]]}", "polygon_m[2]: must be a list of 2 numbers"),
    ("{name: a, kind: no_go, polygon_m: [[90, 0], [91, 0], [91, 9]]}", "contains the centre of no cell of the map"),
    (f"{{name: a, kind: no_go, polygon_m: {WEST}}}", "polygon_m: c1 starts there"),
    ("{name: a, kind: priority, polygon_m: [[0, 0], [9, 0], [9, 9]]}", "weight: missing"),
    ("{name: a, kind: priority, weight: 0.5, polygon_m: [[0, 0], [9, 0], [9, 9]]}", "weight: must be 1 or more"),
    ("{name: a, kind: explore, weight: 2, polygon_m: [[0, 0], [9, 0], [9, 9]]}", "weight: only zones 'priority' have"),
    (f"{{name: a, kind: no_go, polygon_m: {EAST}, from_s: 5, until_s: 5}}", "until_s: must be after from_s"),
    (f"{{name: a, kind: no_go, polygon_m: {EAST}}}, {{name: a, kind: no_go, polygon_m: {EAST}}}", "is used twice"),
]


@pytest.mark.parametrize(("zones", "fault"), WRONG)
def test_a_wrong_zone_is_refused(zones: str, fault: str) -> None:
    with pytest.raises(ScenarioError) as error:
        yard(f"zones: [{zones}]\n")
    assert fault in str(error.value)


def test_a_zone_over_the_home_of_a_team_that_returns_is_refused() -> None:
    zone = f"zones: [{{name: west, kind: no_go, polygon_m: {WEST}, from_s: 20}}]\ngoal: {{return_home: true}}\n"
    with pytest.raises(ScenarioError, match="c1 has to return there: it is its home"):
        yard(zone)


def test_zones_are_written_as_they_are_read() -> None:
    priority = "zones: [{name: a, kind: priority, weight: 2.5, polygon_m: [[0, 0], [9, 0], [9, 9]], until_s: 0.5}]\n"
    for dated in (*yard(LATER).zones, *yard(AREA).zones, *yard(priority).zones):
        assert zone_in(json.loads(json.dumps(zone_fields(dated)))) == dated


def test_a_zone_that_an_operator_changes_follows_its_schedule_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    square = Zone(kind=ZoneKind.NO_GO, polygon_m=((4.0, 0.0), (6.0, 0.0), (6.0, 3.0), (4.0, 3.0)))
    kinds = kinds_of()
    inner = SimulatedWorld(drawn_grid(*CORRIDOR), kinds, [carrier_at(2, 1)])
    dated = [DatedZone(name=name, zone=square, from_ms=0, until_ms=9000) for name in ("z1", "z2")]
    world = Belief(inner, kinds, dated, lambda *_: None)
    world.advance(0)
    operated = News(t_ms=1000, zones=(ZoneChange(name="z1", zone=square),))
    with monkeypatch.context() as patch:
        patch.setattr(inner, "advance", lambda until_ms: operated)
        world.advance(1000)
    assert [change.name for change in world.advance(9000).zones] == ["z2"]
    assert world.no_go == "no-go zones: z1"
