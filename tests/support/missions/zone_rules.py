"""Who enters a no-go zone that is known, by the events of a mission."""

from collections.abc import Iterator, Sequence

from marsupial.maps.discs import disc
from marsupial.model import Cell, Grid, MissionEvent, RobotType
from marsupial.model.mission import ActionStarted, DriveEnded, DriveStarted, ZoneChanged, started
from marsupial.model.plan import ActionName
from marsupial.model.zones import ZoneKind, covered
from marsupial.paths.routes import passing_times_ms, route_of

Visits = dict[str, list[tuple[int, Cell]]]


def trespasses(grid: Grid, events: Sequence[MissionEvent]) -> Iterator[str]:
    """Yield each step of a robot into a no-go zone that holds, but for the step that it was taking when it began."""
    kinds = {kind.name: kind for kind in started(events).types}
    kind_of = {robot.name: kinds[robot.type] for robot in started(events).robots}
    visits = _visits(grid, events, kind_of)
    for i, begun in enumerate(events):
        if not isinstance(begun, ZoneChanged) or begun.zone is None or begun.zone.kind is not ZoneKind.NO_GO:
            continue
        ends = (e.t_ms for e in events[i + 1 :] if isinstance(e, ZoneChanged) and e.name == begun.name)
        until_ms, mask = next(ends, events[-1].t_ms), covered(grid, begun.zone.polygon_m)
        for name, seen in visits.items():
            offsets = disc(kind_of[name].radius_m / grid.resolution_m)
            free = True  # the first step after the zone began was under way
            for t_ms, cell in (visit for visit in seen if visit[0] <= until_ms):
                x, y = (offsets + cell).T
                inside = bool(mask[y, x].any())
                if inside and t_ms > begun.t_ms and not free:
                    yield f"{name} enters {begun.name} at {cell}, {t_ms} ms"
                free = inside or t_ms <= begun.t_ms


def _visits(grid: Grid, events: Sequence[MissionEvent], kinds: dict[str, RobotType]) -> Visits:
    """Return when each robot on the ground passes which cell."""
    visits: Visits = {r.name: [] if r.cell is None else [(0, r.cell)] for r in started(events).robots}
    for event in events:
        if isinstance(event, DriveStarted | DriveEnded):
            seen = visits[event.robot]
            while seen[-1][0] > event.t_ms:  # it was stopped, or goes on otherwise
                seen.pop()
            seen.append((event.t_ms, event.cell))
        if isinstance(event, DriveStarted):
            kind, route = kinds[event.robot], route_of(event.cell, event.steps)
            times = passing_times_ms(route, grid.resolution_m, kind.speed_mps, kind.diagonal)
            visits[event.robot] += list(zip((event.t_ms + times).tolist(), route, strict=True))[1:]
        if isinstance(event, ActionStarted) and event.action.name is ActionName.UNDOCK:
            visits[event.action.robot].append((event.t_ms, event.cell))
    return visits
