"""The state of a running mission, updated by its events, and its coverage."""

from __future__ import annotations

import numpy as np

from marsupial.mission.state import MissionTracker, RobotView, views
from marsupial.model.grid import UNKNOWN, Mask


class MissionWatch(MissionTracker):
    """The state of a running mission. `area`: mask (height, width) of the cells to explore."""

    def __init__(self) -> None:
        super().__init__()
        self.area: Mask = np.zeros((0, 0), dtype=np.bool_)

    def reachable(self, area: Mask) -> None:
        """Set the cells to explore."""
        self.area = area

    @property
    def coverage(self) -> float:
        """Known share of the reachable cells, 0 to 1."""
        wanted = int(np.count_nonzero(self.area))
        return int(np.count_nonzero(self.cells[self.area] != UNKNOWN)) / wanted if wanted else 1.0

    def views(self) -> tuple[RobotView, ...]:
        """Return the present state of every robot, in the order of the team."""
        return views(self.tracks, self.t_ms, whole_cells=True)
