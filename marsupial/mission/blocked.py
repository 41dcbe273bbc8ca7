"""Robots whose way or place the map no longer allows, as cells or zones have changed."""

from collections.abc import Mapping

from marsupial.maps.discs import fits
from marsupial.mission.executor import Executor
from marsupial.model import RobotType
from marsupial.model.mission import Cause, Trigger, Triggers
from marsupial.model.world import News, World
from marsupial.model.zones import unzoned


def stop_blocked(news: News, world: World, kinds: Mapping[str, RobotType], executor: Executor) -> Triggers:
    """Stop robots whose drives changed cells block; return the trigger for a new plan, if any robot stopped."""
    # newly seen cells block no robot: routes lead over known cells only
    if not (news.changed or news.zones):
        return ()
    grid = world.grid
    # robots on their way out of zones continue, unless another zone may be in their way now
    ground = grid if news.zones else unzoned(grid)
    names = executor.stop_blocked(
        lambda kind, cells: fits(grid, kinds[kind], *cells),
        lambda kind, cells: fits(ground, kinds[kind], *cells),
    )
    return (Trigger(Cause.WAY_BLOCKED, names),) if names else ()


def gone_astray(news: News, world: World, kinds: Mapping[str, RobotType]) -> Triggers:
    """Return the trigger for robots that missed their goals and ended in a no-go zone: they leave it first."""
    grid = world.grid
    if grid.zoning is None or not news.finished:
        return ()
    ended = ((r.name, r.type, r.cell) for r in world.robots() if r.name in news.finished)
    names = tuple(n for n, kind, cell in ended if cell is not None and not fits(grid, kinds[kind], cell))
    return (Trigger(Cause.WAY_BLOCKED, names),) if names else ()
