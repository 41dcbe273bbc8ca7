"""A mission over ROS whose map ends where SLAM has seen the last obstacle."""

from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("websockets")

import numpy as np
from fake_ros import FakeRos
from ros_missions import BridgeUser, drive
from ros_rooms import team
from support.services.servers import Server

from marsupial.model.grid import FLOOR, OBSTACLE, Cell, Grid


class HitsRos(FakeRos):
    """Publishes the box of what its robots' sensors hit, as slam_toolbox does."""

    def _known_box(self) -> tuple[int, int, int, int]:
        rows, columns = np.nonzero(self.known == OBSTACLE)
        if not len(rows):
            return 0, 0, 1, 1
        return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1


async def test_a_corridor_is_explored_to_its_end_though_the_map_ends_with_the_last_hit(
    server: Server, tmp_path: Path
) -> None:
    cells = np.full((9, 60), OBSTACLE, dtype=np.uint8)
    cells[1:-1, 1:-1] = FLOOR
    grid = Grid(cells=cells, resolution_m=0.25)
    robots = [replace(robot, at=grid.centre_m(Cell(5, 4))) for robot in team(grid, carriers=1)]
    async with HitsRos(grid, robots) as ros:
        outcome = await drive(*BridgeUser().bridge(server, ros, tmp_path))
    assert outcome.ended["status"] == "complete", outcome
    assert np.count_nonzero(ros.known == FLOOR) == 7 * 58
