import pytest

from marsupial.model import Action, ActionEnd, ActionName
from marsupial.model.team import Deployments, Whereabouts, after

GROUND: Whereabouts[str] = Whereabouts("door")
ABOARD: Whereabouts[str] = Whereabouts(None, "c1")


def meet(name: ActionName) -> Action:
    return Action(name=name, start_ms=0, duration_ms=5, robot="r1", place="door", carrier="c1")


def test_a_rover_that_docks_has_its_place_at_once_and_is_aboard_at_the_end() -> None:
    docking = GROUND.begun(ActionName.DOCK, "door", "c1")
    assert (docking.at, docking.carrier, docking.aboard) == ("door", "c1", None)
    docked = docking.ended(ActionName.DOCK, ActionEnd.DONE)
    assert (docked.at, docked.carrier, docked.aboard) == (None, "c1", "c1")


def test_a_docking_that_fails_leaves_the_rover_where_it_stands() -> None:
    assert GROUND.begun(ActionName.DOCK, "door", "c1").ended(ActionName.DOCK, ActionEnd.FAILED) == GROUND


def test_a_rover_that_is_set_down_is_on_the_ground_at_once_and_aboard_again_if_that_fails() -> None:
    leaving = ABOARD.begun(ActionName.UNDOCK, "door")
    assert (leaving.at, leaving.carrier, leaving.aboard) == ("door", None, None)
    assert leaving.ended(ActionName.UNDOCK, ActionEnd.DONE).aboard is None
    assert leaving.ended(ActionName.UNDOCK, ActionEnd.FAILED) == ABOARD


@pytest.mark.parametrize("name", [ActionName.DOCK, ActionName.UNDOCK])
@pytest.mark.parametrize("end", list(ActionEnd))
def test_the_end_of_what_was_not_begun_changes_nothing(name: ActionName, end: ActionEnd) -> None:
    assert GROUND.ended(name, end) == GROUND
    assert ABOARD.ended(name, end) == ABOARD


def test_a_plan_has_a_rover_aboard_after_a_dock_and_at_the_place_after_anything_else() -> None:
    assert after(meet(ActionName.DOCK)) == ABOARD
    assert after(meet(ActionName.UNDOCK)) == GROUND


def test_deployments_are_counted_and_their_meeting_points_held_until_the_rover_is_back() -> None:
    deployments = Deployments()
    deployments.done(meet(ActionName.UNDOCK))
    assert (deployments.deployed, deployments.retrieved, deployments.at) == (1, 0, {"r1": "door"})
    deployments.done(meet(ActionName.DOCK))
    assert (deployments.deployed, deployments.retrieved, deployments.at) == (1, 1, {})
