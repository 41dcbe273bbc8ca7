from marsupial.cli.process.exit_codes import ERROR_CODES, MISSION_CODES, PLANNING_CODES
from marsupial.errors import MarsupialError
from marsupial.model import Outcome, Status


def leaves(kind: type[MarsupialError]) -> set[type[MarsupialError]]:
    below = kind.__subclasses__()
    return set().union(*(leaves(one) for one in below)) if below else {kind}


def test_every_leaf_of_the_error_tree_has_a_code() -> None:
    project = {kind for kind in leaves(MarsupialError) if kind.__module__ == "marsupial.errors"}
    assert project <= ERROR_CODES.keys()


def test_every_status_and_every_outcome_has_a_code() -> None:
    assert set(MISSION_CODES) == set(Status)
    assert set(PLANNING_CODES) == set(Outcome)


def test_only_a_complete_mission_is_a_success() -> None:
    assert [status for status, code in MISSION_CODES.items() if code == 0] == [Status.COMPLETE]
