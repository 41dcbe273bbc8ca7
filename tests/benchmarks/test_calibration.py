"""The promises of plans, against a mission of three plans made up here."""

from benchmarks.studies.calibration import Promises
from marsupial.model import Action, ActionName, Cell
from marsupial.model.mission import MapTarget, Planned


def _explore(robot: str, place: str, end_ms: int) -> Action:
    return Action(
        name=ActionName.EXPLORE, start_ms=end_ms - 1000, duration_ms=1000, robot=robot, place=place, origin="s"
    )


def _plan(t_ms: int, targets: str, *actions: Action) -> Planned:
    shown = tuple(
        MapTarget(name=name, cell=Cell(0, 0), explorers=("rover",), reveal_m2=1.0, frontier_cells=1) for name in targets
    )
    return Planned(t_ms=t_ms, revision=1, trigger=(), targets=shown, meetings=(), actions=actions)


def test_targets_are_explored_when_the_next_plan_no_longer_has_them() -> None:
    undock = Action(
        name=ActionName.UNDOCK, start_ms=0, duration_ms=1, robot="rover1", place="m", carrier="carrier1", origin=None
    )
    plans = [
        _plan(0, "ab", undock, _explore("rover1", "a", 9000), _explore("rover1", "b", 15_000)),
        _plan(4000, "b", _explore("carrier1", "b", 20_000)),
        _plan(7000, "b", _explore("rover1", "b", 9000)),
    ]
    promises = Promises(explored_ms=10_000, plans=plans)

    found = list(promises.of(frozenset({"carrier1"})))

    assert sorted(found) == [
        (("carrier", "next"), 16.0, 6.0),
        (("rover on the ground", "next"), 2.0, 3.0),
        (("rover set down first", "later"), 15.0, 10.0),
        (("rover set down first", "next"), 9.0, 4.0),
    ]


def test_missions_that_left_something_promise_nothing() -> None:
    promises = Promises(explored_ms=None, plans=[_plan(0, "a", _explore("rover1", "a", 9000))])

    assert not list(promises.of(frozenset()))
