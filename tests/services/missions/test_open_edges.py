"""Missions whose map ends where the last obstacle was seen, as SLAM publishes it."""

import json
from typing import Any

import numpy as np
import pytest
from mission_setup import Hosted, brief_from, replayed
from support.missions.small_teams import carrier_at, kinds_of

from marsupial.formats.loglines import LogDecoder
from marsupial.formats.scenario.write import type_fields
from marsupial.mission.belief.vain import UNREVEALED
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Cell, CellArray, Grid
from marsupial.model.mission import FrameGrown, MissionEnded, MissionEvent, Planned, Status
from marsupial.model.missionframe import MissionFrame
from marsupial.model.runs import cells_in, known_runs
from marsupial_service.missions.simulated import SimulatedTeam
from marsupial_service.missions.values import MissionBatch, MissionReport, PendingInput
from marsupial_service.schemas.enums import EventType
from marsupial_service.schemas.missions import MapRunsBody


def corridor(length: int = 16) -> CellArray:
    cells = np.full((5, length), OBSTACLE, dtype=np.uint8)
    cells[1:4, 1:-1] = FLOOR
    return cells


class BoxedClient:
    """Explores a map with one carrier, and reports only the box of the obstacles, or of all cells, that it has seen."""

    def __init__(self, truth: CellArray, start: Cell, *, all_cells: bool = False, **asked: Any) -> None:
        self.all_cells = all_cells
        kind = kinds_of()["carrier"]
        self.truth = Grid(cells=truth, resolution_m=1.0)
        self.team = SimulatedTeam(self.truth, {"carrier": kind}, [carrier_at(*start)])
        self.known = np.full_like(truth, UNKNOWN)
        # the first frame is 3 x 3 cells around the start; frames of the mission are relative to it
        self.corner = Cell(start.x - 1, start.y - 1)
        self.frame = MissionFrame(0, 0, 3, 3)
        self.brief = brief_from(
            {
                "frame": {"width": 3, "height": 3, "resolution_m": 1.0},
                "robot_types": [type_fields(kind, {FLOOR: "floor"})],
                "team": [{"name": "c1", "type": "carrier", "cell": [1, 1]}],
                "planner": "greedy",
                "budget": {"steps": 1},
                **asked,
            }
        )
        self.batches: list[MissionBatch] = []
        self.inputs: list[MissionReport] = []
        self._decoder = LogDecoder()
        self.log: list[MissionEvent] = []

    def run(self) -> MissionEnded:
        with Hosted(self.brief) as hosted:
            due: MissionReport | None = None
            while True:
                batch = hosted.batch(PendingInput(input=due))
                self.batches.append(batch)
                for event in batch.events:
                    if event.type is EventType.FRAME:
                        self._grow(json.loads(event.data))
                    elif event.type is EventType.LOG:
                        self.log.append(self._decoder.event(event.data))
                if batch.over:
                    ended = self.log[-1]
                    assert isinstance(ended, MissionEnded)
                    return ended
                (commands,) = (json.loads(event.data) for event in batch.events if event.type is EventType.COMMANDS)
                self.inputs.append(due := self._carry_out(commands))

    def _grow(self, frame: dict[str, Any]) -> None:
        x, y = frame["shift"]
        self.frame = MissionFrame(self.frame.x - x, self.frame.y - y, frame["width"], frame["height"])
        corner = Cell(self.corner.x + self.frame.x, self.corner.y + self.frame.y)
        assert frame["origin_m"][:2] == [self.frame.x, self.frame.y]
        assert corner.x >= 0
        assert corner.y >= 0

    def _carry_out(self, commands: dict[str, Any]) -> MissionReport:
        left, low = self.corner.x + self.frame.x, self.corner.y + self.frame.y
        for command in commands["commands"]:
            if command["name"] == "drive":
                centres = [[x + self.frame.x + 0.5, y + self.frame.y + 0.5] for x, y in command["route"]]
                assert command["route_m"] == centres
                command["route"] = [[x + left, y + low] for x, y in command["route"]]
        report = self.team.report(commands)
        assert report is not None
        for seen in report.revealed:
            indices, codes = cells_in(seen.runs)
            self.known.ravel()[indices] = codes
        rows, columns = np.nonzero(self.known != UNKNOWN if self.all_cells else self.known == OBSTACLE)
        x, y = int(columns.min()), int(rows.min())
        box = self.known[y : rows.max() + 1, x : columns.max() + 1]
        cells = [one.cell and Cell(one.cell.x - x, one.cell.y - y) for one in report.robots]
        robots = [one.model_copy(update={"cell": cell}) for one, cell in zip(report.robots, cells, strict=True)]
        frame = MissionFrame(x - self.corner.x, y - self.corner.y, box.shape[1], box.shape[0])
        changes = {"revealed": [], "map": MapRunsBody(runs=known_runs(box)), "robots": robots, "frame": frame}
        return report.model_copy(update=changes)

    @property
    def explored(self) -> int:
        return int(np.count_nonzero(self.known == FLOOR))


@pytest.mark.parametrize("turns", range(4))
def test_a_corridor_that_is_open_at_an_edge_of_the_map_is_explored_to_its_end(turns: int) -> None:
    truth = np.ascontiguousarray(np.rot90(corridor(), turns))
    start = Cell(*np.argwhere(np.rot90(np.arange(truth.size).reshape(5, 16) == 2 * 16 + 4, turns))[0][::-1].tolist())
    client = BoxedClient(truth, start)
    ended = client.run()
    assert (ended.status, client.explored) == (Status.COMPLETE, np.count_nonzero(truth == FLOOR))


def test_without_ground_beyond_its_edge_a_map_is_explored_when_it_is_known() -> None:
    client = BoxedClient(corridor(), Cell(4, 2), map_may_grow=False)
    ended = client.run()
    assert ended.status is Status.COMPLETE
    assert client.explored < np.count_nonzero(client.truth.cells == FLOOR)


def test_cells_are_of_the_frames_of_the_client_and_names_of_its_first_one() -> None:
    client = BoxedClient(corridor(), Cell(10, 2))
    client.run()
    width, height, left, low, targets = 3, 3, 0, 0, 0
    for event in client.log:
        if isinstance(event, FrameGrown):
            width, height = event.width, event.height
            left, low = left - event.shift.x, low - event.shift.y
        for target in event.targets if isinstance(event, Planned) else ():
            x, y = target.cell
            assert (0 <= x < width, 0 <= y < height, target.name) == (True, True, f"t_{x + left}_{y + low}")
            targets += 1
    assert targets
    assert replayed(client.brief, client.inputs, client.batches) == client.batches


def test_free_cells_at_the_edge_of_a_whole_map_are_given_up_after_three_looks() -> None:
    truth = np.full((5, 9), FLOOR, dtype=np.uint8)
    ends = [BoxedClient(truth, Cell(1, 1), all_cells=True, map_may_grow=grows).run() for grows in (True, False)]
    assert [(ended.status, ended.explored_area_m2) for ended in ends] == [(Status.COMPLETE, 45.0)] * 2
    assert {left.reason for left in ends[0].remaining} == {UNREVEALED}
    assert all(0 <= left.cell.x < 9 and 0 <= left.cell.y < 5 for left in ends[0].remaining)
