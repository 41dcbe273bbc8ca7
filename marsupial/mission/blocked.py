"""Robots whose way or place the map no longer allows, as cells or zones have changed."""

from marsupial.maps.discs import fits
from marsupial.mission.belief.belief import Belief
from marsupial.mission.executor import Executor
from marsupial.model.mission import Cause, Trigger, Triggers
from marsupial.model.world import News
from marsupial.model.zones import unzoned


def stop_blocked(news: News, belief: Belief, executor: Executor) -> Triggers:
    """Stop robots whose drives changed cells block; return the trigger for a new plan, if any robot stopped."""
    # newly seen cells block no robot: routes lead over known cells only
    if not (news.changed or news.zones):
        return ()
    grid, kinds = belief.grid, belief.kinds
    # robots on their way out of zones continue, unless another zone may be in their way now
    ground = grid if news.zones else unzoned(grid)
    names = executor.stop_blocked(
        lambda kind, cells: fits(grid, kinds[kind], *cells),
        lambda kind, cells: fits(ground, kinds[kind], *cells),
    )
    return (Trigger(Cause.WAY_BLOCKED, names),) if names else ()


def gone_astray(news: News, belief: Belief) -> Triggers:
    """Return the trigger for robots that missed their goals and ended in a no-go zone: they leave it first."""
    grid = belief.grid
    if grid.zoning is None or not news.finished:
        return ()
    ended = ((r.name, r.type, r.cell) for r in belief.robots() if r.name in news.finished)
    names = tuple(n for n, kind, cell in ended if cell is not None and not fits(grid, belief.kinds[kind], cell))
    return (Trigger(Cause.WAY_BLOCKED, names),) if names else ()
