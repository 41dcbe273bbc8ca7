import numpy as np
from support.missions.synthetic_mission import synthetic_mission

from marsupial.exports.trails import drives, handovers, trail
from marsupial.mission.playback import Playback
from marsupial.model.plan import ActionName

PLAYBACK = Playback(synthetic_mission())


def test_a_drive_ends_where_the_robot_was_stopped() -> None:
    found = drives(PLAYBACK)
    ends = [(tuple(drive.cells[0]), tuple(drive.cells[-1])) for drive in found["rover1_1"]]
    assert ends == [((28, 20), (33, 20)), ((33, 20), (34, 20)), ((34, 20), (28, 20))]
    assert [(tuple(d.cells[0]), tuple(d.cells[-1])) for d in found["carrier1"]] == [((6, 20), (26, 20))]
    assert found["rover1_2"] == []


def test_a_trail_ends_at_the_robot() -> None:
    (drive,) = drives(PLAYBACK)["carrier1"]
    assert drive.upto(1125)[-1].tolist() == [10.5, 20.0]
    assert trail([drive], 9000)[-2].tolist() == [26.0, 20.0]
    assert np.isnan(trail([drive], 9000)[-1]).all()
    assert trail([drive], 0).shape == (0, 2)


def test_rovers_are_handed_over_where_docking_and_undocking_was_done() -> None:
    assert [(place.t_ms, place.name) for place in handovers(PLAYBACK)] == [
        (10_001, ActionName.UNDOCK),
        (26_005, ActionName.DOCK),
    ]
