"""Missions whose map changes and grows beyond its frame: log, playback and page."""

from dataclasses import replace

import numpy as np
import pytest
from support.missions.growing_mission import EVENTS, MORE, SHIFT, growing_mission

from marsupial.errors import LogError
from marsupial.formats.loglines import log_lines
from marsupial.formats.missionlog import parse_log
from marsupial.mission.playback import Playback
from marsupial.mission.state import MissionTracker
from marsupial.model import UNKNOWN, Cell, Changed, FrameGrown, Grid, GuessedGround, Planned
from marsupial.model.frames import in_last_frame, moved_event
from marsupial.model.missionframe import MissionFrame

GROWN = growing_mission()


def test_a_log_of_a_changing_map_reads_back() -> None:
    assert parse_log("".join(f"{line}\n" for line in log_lines(GROWN)).encode()).events == GROWN


def test_a_frame_that_does_not_hold_the_one_before_is_no_line_of_a_log() -> None:
    wrong = [replace(event, shift=Cell(8, 0)) if isinstance(event, FrameGrown) else event for event in GROWN]
    with pytest.raises(LogError, match="must lead into a frame that holds the one before"):
        parse_log("".join(f"{line}\n" for line in log_lines(wrong)).encode())


def test_a_mission_is_played_back_in_its_last_frame() -> None:
    both = SHIFT.then(MORE)
    expected = [moved_event(event, both) for event in EVENTS]
    found = [event for event in in_last_frame(GROWN) if not isinstance(event, Changed)]
    assert found[1:] == expected[1:]
    assert found[0] == replace(expected[0], origin_m=(-1.0, -3.0, 0.0))  # type: ignore[call-arg]
    assert in_last_frame(EVENTS) == EVENTS


def test_guessed_squares_move_with_the_frame() -> None:
    plan = next(event for event in EVENTS if isinstance(event, Planned))
    guess = GuessedGround(corner=Cell(-2, 0), side=8, halls=(Cell(1, 0),), rooms=())
    moved = moved_event(replace(plan, guess=guess), SHIFT)
    assert isinstance(moved, Planned)
    assert moved.guess == replace(guess, corner=Cell(1, 2))


def test_live_tracking_equals_the_playback() -> None:
    tracker, playback = MissionTracker(), Playback(GROWN)
    for event in GROWN:
        tracker.event(event)
    assert np.array_equal(tracker.cells, playback.cells_at(GROWN[-1].t_ms))
    assert tracker.tracks == playback.moments[-1][1]


def test_cells_that_change_count_once_in_what_is_known() -> None:
    playback = Playback(GROWN)
    area_m2 = playback.mission.resolution_m**2
    for t_ms in (0, 5000, 12_502, 26_005):
        cells, known = playback.cells_at(t_ms), playback.coverage_at(t_ms)
        assert known.seen_m2 == pytest.approx(np.count_nonzero(cells != 255) * area_m2)
        assert known.open_m2 == pytest.approx(np.count_nonzero((cells != 255) & (cells != 0)) * area_m2)


def test_a_place_has_the_same_name_in_all_frames() -> None:
    grid = Grid(cells=np.ones((6, 8), dtype=np.uint8), resolution_m=1.0)
    frame = MissionFrame.of(grid).grown_by(SHIFT.by, SHIFT.width, SHIFT.height)
    grown = frame.grid(grid, SHIFT.laid_out(grid.cells, UNKNOWN))
    for cell in (Cell(4, 5), Cell(0, 0)):
        assert grown.name_of("t", SHIFT.cell(cell)) == grid.name_of("t", cell)
    assert grown.name_of("m", Cell(1, 2), Cell(3, 4)) == "m_-2_0_0_2"
