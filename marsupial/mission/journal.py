"""What the mission log says of news about the map and of drives.

The log holds the raw map, so that a mission can be replayed as its robots reported it.
"""

from collections.abc import Iterator

from marsupial.model import Grid
from marsupial.model import mission as log
from marsupial.model.mission import MissionEvent
from marsupial.model.runs import runs_of
from marsupial.model.world import News
from marsupial.paths.routes import steps_of


def events_of(news: News, raw_news: News, raw_grid: Grid) -> Iterator[MissionEvent]:
    """Yield the events of zones, of cells seen and changed (both of the raw map), of speeds and of drives."""
    t_ms = news.t_ms
    for change in news.zones:
        yield log.ZoneChanged(t_ms=t_ms, name=change.name, zone=change.zone)
    for kind, seen in ((log.Revealed, raw_news.revealed), (log.Changed, raw_news.changed)):
        for name, indices in seen:
            yield kind(t_ms=t_ms, robot=name, runs=runs_of(indices, raw_grid.cells.ravel()))
    for name, share in news.slowed:
        yield log.SpeedChanged(t_ms=t_ms, robot=name, share=share)
    for name, cells in news.passages:
        if len(cells) == 1:
            yield log.DriveEnded(t_ms=t_ms, robot=name, cell=cells[0])
        else:
            yield log.DriveStarted(t_ms=t_ms, robot=name, cell=cells[0], steps=steps_of(cells))
