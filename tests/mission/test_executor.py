from dataclasses import replace

from mission_fakes import FakeWorld, drive, meet, plan_of
from support.missions.small_missions import Recorder

from marsupial.mission.executor import Executor
from marsupial.model.frames import FrameShift
from marsupial.model.grid import Cell
from marsupial.model.mission import ActionEnd, ActionEnded, ActionStarted, DriveEnded
from marsupial.model.plan import Action, ActionName, Plan
from marsupial.model.world import RobotReport
from marsupial.paths.routes import Route

MOVE, EXPLORE, DOCK, UNDOCK = ActionName.MOVE, ActionName.EXPLORE, ActionName.DOCK, ActionName.UNDOCK
DOOR, OTHER_DOOR = Cell(10, 1), Cell(20, 1)
POSES = {
    "m1": {"carrier": DOOR, "rover": Cell(11, 1)},
    "m2": {"carrier": OTHER_DOOR, "rover": Cell(21, 1)},
    "t1": {"carrier": Cell(5, 1), "rover": Cell(5, 1)},
    "t2": {"carrier": Cell(15, 1), "rover": Cell(15, 1)},
}


def robot(name: str, cell: Cell | None = None, carrier: str | None = None) -> RobotReport:
    kind = "carrier" if name.startswith("c") else "rover"
    return RobotReport(name=name, type=kind, cell=cell, carrier=carrier, free_at_ms=0)


def straight(_kind: str, start: Cell, goal: Cell, _heading: int | None) -> Route:
    step = 1 if goal.x >= start.x else -1
    return tuple(Cell(x, 1) for x in range(start.x, goal.x + step, step))


class Stage:
    """An executor in a fake world."""

    def __init__(self, *robots: RobotReport) -> None:
        self.world = FakeWorld(*robots)
        self.seen = Recorder()
        self.closed = False
        self.revision = 0
        self.executor = Executor(
            self.world, self.world.robots, lambda *way: None if self.closed else straight(*way), self.seen
        )

    def follow(self, *actions: Action) -> Plan:
        plan = plan_of(actions)
        self.revision += 1
        self.executor.adopt(plan, POSES, self.revision, {})
        self.executor.start_due()
        return plan

    def commands(self) -> list[tuple[object, ...]]:
        """Return the commands since the last call."""
        given, self.world.commands = self.world.commands, []
        return given

    def ends(self) -> list[tuple[str, ActionEnd]]:
        return [(str(e.action), e.end) for e in self.seen.of(ActionEnded)]  # type: ignore[attr-defined]


def in_the_hall() -> Stage:
    return Stage(robot("c1", Cell(0, 1)), robot("r1", carrier="c1"))


def test_an_undock_waits_for_the_carrier_and_is_counted_when_done() -> None:
    stage = in_the_hall()
    stage.follow(drive(MOVE, "c1", "m1", "s_c1"), meet(UNDOCK, "r1", "c1", "m1"))
    assert stage.commands() == [("drive", "c1", DOOR)]
    stage.world.put("c1", DOOR)
    stage.executor.finished(["c1"])
    stage.executor.start_due()
    assert stage.commands() == [("undock", "r1", "c1", Cell(11, 1))]
    assert stage.executor.deployments.deployed == 0
    stage.executor.finished(["c1", "r1"])
    assert (stage.executor.deployments.deployed, stage.executor.deployed_at) == (1, {"r1": "m1"})
    assert stage.executor.idle


def test_a_dock_waits_for_both_and_is_counted_when_done() -> None:
    stage = Stage(robot("c1", Cell(0, 1)), robot("r1", Cell(15, 1)))
    stage.executor.deployed_at["r1"] = "m2"
    stage.follow(drive(MOVE, "c1", "m1", "s_c1"), drive(MOVE, "r1", "m1", "s_r1"), meet(DOCK, "r1", "c1", "m1"))
    assert stage.commands() == [("drive", "c1", DOOR), ("drive", "r1", Cell(11, 1))]
    stage.world.put("r1", Cell(11, 1))
    stage.executor.finished(["r1"])
    stage.executor.start_due()
    assert stage.commands() == []
    stage.world.put("c1", DOOR)
    stage.executor.finished(["c1"])
    stage.executor.start_due()
    assert stage.commands() == [("dock", "r1", "c1")]
    stage.executor.finished(["c1", "r1"])
    assert (stage.executor.deployments.retrieved, stage.executor.deployed_at) == (1, {})


def test_a_robot_waits_for_its_late_partner() -> None:
    stage = Stage(robot("c1", DOOR), robot("r1", Cell(15, 1)))
    stage.follow(drive(MOVE, "r1", "m1", "s_r1"), meet(DOCK, "r1", "c1", "m1"), drive(EXPLORE, "c1", "t2", "s_c1"))
    assert stage.commands() == [("drive", "r1", Cell(11, 1))]


def test_a_drive_that_the_new_plan_keeps_continues() -> None:
    stage = in_the_hall()
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"))
    stage.commands()
    new = stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"), drive(EXPLORE, "c1", "t2", "t1"))
    assert stage.commands() == []
    assert stage.executor.remainder() == new.actions
    stage.executor.finished(["c1"])
    assert stage.ends() == [("(explore c1 s_c1 t1)", ActionEnd.DONE)]
    assert [event.revision for event in stage.seen.of(ActionEnded)] == [2]  # type: ignore[attr-defined]


def test_a_drive_that_the_new_plan_does_not_want_stops_and_ends_as_superseded() -> None:
    stage = in_the_hall()
    stage.follow(drive(EXPLORE, "c1", "t2", "s_c1"))
    stage.commands()
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"))
    assert stage.commands() == [("stop", "c1")]
    stage.world.put("c1", Cell(2, 1))
    assert stage.executor.finished(["c1"]) == ()
    assert stage.ends() == [("(explore c1 s_c1 t2)", ActionEnd.SUPERSEDED)]
    assert [event.cell for event in stage.seen.of(DriveEnded)] == [Cell(2, 1)]  # type: ignore[attr-defined]
    stage.executor.start_due()
    assert stage.commands() == [("drive", "c1", Cell(5, 1))]


def test_a_stopping_drive_stays_superseded_even_if_the_next_plan_wants_it_again() -> None:
    stage = in_the_hall()
    stage.follow(drive(EXPLORE, "c1", "t2", "s_c1"))
    stage.follow()
    stage.commands()
    stage.follow(drive(EXPLORE, "c1", "t2", "s_c1"))
    stage.world.put("c1", Cell(1, 1))
    assert stage.executor.finished(["c1"]) == ()
    stage.executor.start_due()
    assert stage.commands() == [("stop", "c1"), ("drive", "c1", Cell(15, 1))]


def test_a_running_undock_is_not_interrupted_by_a_new_plan() -> None:
    stage = Stage(robot("c1", DOOR), robot("r1", carrier="c1"))
    stage.follow(meet(UNDOCK, "r1", "c1", "m1"))
    stage.commands()
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"), drive(EXPLORE, "r1", "t2", "s_r1"))
    assert stage.commands() == []
    stage.world.put("r1", Cell(11, 1))
    stage.executor.finished(["c1", "r1"])
    assert stage.ends() == [("(undock r1 c1 m1)", ActionEnd.DONE)]
    assert stage.executor.deployments.deployed == 1
    stage.executor.start_due()
    assert stage.commands() == [("drive", "c1", Cell(5, 1)), ("drive", "r1", Cell(15, 1))]


def test_a_blocked_way_is_reported_once_and_drops_what_the_robot_was_to_do() -> None:
    stage = in_the_hall()
    stage.closed = True
    stage.executor.adopt(plan_of([drive(EXPLORE, "c1", "t1", "s_c1"), drive(MOVE, "c1", "m1", "t1")]), POSES, 1, {})
    assert stage.executor.start_due() == ("c1",)
    assert stage.executor.start_due() == ()
    assert stage.ends() == [("(explore c1 s_c1 t1)", ActionEnd.BLOCKED)]
    assert not stage.seen.of(ActionStarted)
    assert stage.executor.idle


def test_one_blocked_robot_does_not_keep_the_others_from_starting() -> None:
    stage = Stage(robot("c1", Cell(0, 1)), robot("c2", Cell(1, 1)), robot("r1", Cell(2, 1)))
    stage.executor = Executor(
        stage.world,
        stage.world.robots,
        lambda kind, a, b, h: None if a == Cell(1, 1) else straight(kind, a, b, h),
        stage.seen,
    )
    plan = plan_of([drive(EXPLORE, name, "t1", f"s_{name}") for name in ("c1", "c2", "r1")])
    stage.executor.adopt(plan, POSES, 1, {})
    assert stage.executor.start_due() == ("c2",)
    assert [command[1] for command in stage.commands()] == ["c1", "r1"]


def test_while_planning_is_charged_only_drives_are_begun() -> None:
    stage = Stage(robot("c1", DOOR), robot("r1", carrier="c1"), robot("c2", Cell(0, 1)))
    stage.executor.adopt(plan_of([meet(UNDOCK, "r1", "c1", "m1"), drive(EXPLORE, "c2", "t1", "s_c2")]), POSES, 1, {})
    stage.executor.start_due(drives_only=True)
    assert stage.commands() == [("drive", "c2", Cell(5, 1))]
    stage.executor.start_due()
    assert stage.commands() == [("undock", "r1", "c1", Cell(11, 1))]


def test_a_lost_robot_frees_its_partner_and_forgets_its_own_plans() -> None:
    stage = Stage(robot("c1", DOOR), robot("r1", carrier="c1"))
    stage.follow(meet(UNDOCK, "r1", "c1", "m1"), drive(EXPLORE, "r1", "t2", "m1"), drive(EXPLORE, "c1", "t1", "m1"))
    stage.commands()
    stage.world.put("r1", Cell(11, 1))
    stage.executor.lost(["r1"])
    assert stage.ends() == [("(undock r1 c1 m1)", ActionEnd.LOST)]
    assert stage.executor.deployments.deployed == 0
    stage.executor.start_due()
    assert stage.commands() == [("drive", "c1", Cell(5, 1))]
    assert stage.executor.finished(["r1"]) == ()


def test_a_robot_lost_on_its_way_stands_where_it_failed() -> None:
    stage = in_the_hall()
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"))
    stage.world.put("c1", Cell(3, 1))
    stage.executor.lost(["c1", "r1"])
    assert [event.cell for event in stage.seen.of(DriveEnded)] == [Cell(3, 1)]  # type: ignore[attr-defined]
    assert stage.ends() == [("(explore c1 s_c1 t1)", ActionEnd.LOST)]
    assert stage.executor.idle


def test_an_undock_that_failed_is_over_and_what_both_were_to_do_next_is_dropped() -> None:
    stage = Stage(robot("c1", DOOR), robot("r1", carrier="c1"), robot("c2", Cell(0, 1)))
    stage.follow(
        meet(UNDOCK, "r1", "c1", "m1"),
        drive(EXPLORE, "r1", "t2", "m1"),
        drive(EXPLORE, "c1", "t1", "m1"),
        drive(EXPLORE, "c2", "t1", "s_c2"),
    )
    stage.commands()
    stage.executor.failed(["c1", "r1"])
    assert stage.ends() == [("(undock r1 c1 m1)", ActionEnd.FAILED)]
    assert (stage.executor.deployments.deployed, stage.executor.deployed_at) == (0, {})
    assert stage.executor.unemployed(["c1"])
    assert stage.executor.unemployed(["r1"])
    assert not stage.executor.unemployed(["c2"])
    stage.executor.start_due()
    assert stage.commands() == []


def test_a_drive_that_failed_ends_where_its_robot_is() -> None:
    stage = in_the_hall()
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"), drive(EXPLORE, "c1", "t2", "t1"))
    stage.world.put("c1", Cell(3, 1))
    stage.executor.failed(["c1"])
    assert [event.cell for event in stage.seen.of(DriveEnded)] == [Cell(3, 1)]  # type: ignore[attr-defined]
    assert stage.ends() == [("(explore c1 s_c1 t1)", ActionEnd.FAILED)]
    assert stage.executor.finished(["c1"]) == ()
    assert stage.executor.idle


def test_a_robot_without_anything_to_do_is_unemployed() -> None:
    stage = Stage(robot("c1", Cell(0, 1)), robot("c2", Cell(1, 1)))
    stage.follow(drive(EXPLORE, "c1", "t1", "s_c1"))
    assert not stage.executor.unemployed(["c1"])
    assert stage.executor.unemployed(["c1", "c2"])
    assert not stage.executor.idle


def test_the_robot_that_can_act_first_is_waited_for() -> None:
    carriers = (robot("c1", Cell(0, 1)), robot("c2", Cell(1, 1)))
    stage = Stage(*(replace(one, free_at_ms=ms) for one, ms in zip(carriers, (3000, 5000), strict=True)))
    stage.follow(drive(MOVE, "c1", "m1", "s_c1"), drive(MOVE, "c2", "m2", "s_c2"))
    assert (stage.commands(), stage.executor.ready_ms) == ([], 3000)


def test_a_rover_that_gets_one_command_at_a_time_drives_back_out_of_contact_without_a_further_one() -> None:
    stage = Stage(robot("c1", Cell(0, 1)), robot("r1", Cell(15, 1)))
    stage.executor.deployed_at["r1"] = "m2"
    stage.follow()
    routes, explores = stage.executor.part("r1", [], holds_plan=False, returns=True)
    assert (routes[-1][-1], explores) == (Cell(21, 1), ())
    stage.executor.start_due()
    assert stage.commands() == []


def test_a_rover_out_of_contact_drives_to_where_its_places_lie_in_a_frame_that_has_grown() -> None:
    stage = Stage(robot("r1", Cell(0, 1)))
    stage.follow(drive(EXPLORE, "r1", "t1", "s_r1"), drive(EXPLORE, "r1", "t2", "t1"))
    stage.executor.part("r1", (), holds_plan=True, returns=False)
    stage.executor.move(FrameShift(Cell(2, 0), 30, 32, 3))
    stage.commands()
    stage.world.put("r1", Cell(7, 1))
    stage.executor.finished(["r1"])
    stage.executor.start_due()
    assert stage.commands() == [("drive", "r1", Cell(17, 1))]
