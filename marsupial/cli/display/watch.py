"""What is going on in a mission, kept up to date from its events, beside what there is to explore."""

from __future__ import annotations

import numpy as np

from marsupial.mission.state import MissionTracker, RobotView, views
from marsupial.model.grid import UNKNOWN, Mask


class Watch(MissionTracker):
    """The state of a mission.

    Attributes
    ----------
    area
        Cells (height, width) that there are to explore.
    """

    def __init__(self) -> None:
        super().__init__()
        self.area: Mask = np.zeros((0, 0), dtype=np.bool_)

    def reachable(self, area: Mask) -> None:
        """Take in what there is to explore."""
        self.area = area

    @property
    def coverage(self) -> float:
        """Known share of the reachable cells, 0 to 1."""
        wanted = int(np.count_nonzero(self.area))
        return int(np.count_nonzero(self.cells[self.area] != UNKNOWN)) / wanted if wanted else 1.0

    def views(self) -> tuple[RobotView, ...]:
        """Return every robot as it is now, in the order of the team."""
        return views(self.tracks, self.t_ms, whole_cells=True)
