"""Rebuilds a moment of a mission from its log: the known map, the robots, and the survey that a planner would get.

A log holds all that a survey needs: revealed cells, drives, running dockings, and meeting points in use. For a moment
at which a plan was made, the result is the state just before that plan, so its survey is the situation that the plan
was made for. For any other moment it is the state after all events of that moment.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from marsupial.errors import UsageError
from marsupial.maps.survey import Survey, Surveyor
from marsupial.maps.territory import Territory
from marsupial.mission.state import MissionTracker, Tracks
from marsupial.model import Action, ActionName, Cell, Deployments, Grid, RobotReport
from marsupial.model import mission as log
from marsupial.model.frames import in_last_frame
from marsupial.model.zones import Zones, zoned


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moment:
    """A mission at one moment."""

    mission: log.MissionStarted
    t_ms: int
    grid: Grid
    robots: tuple[RobotReport, ...]  # the reports that the world would give of all robots
    meetings: tuple[log.MapMeeting, ...]  # in use
    zones: Zones

    def survey(self) -> Survey:
        """Return the survey of the robots on the known map."""
        homes = {robot.name: robot.cell for robot in self.mission.robots if robot.cell is not None}
        surveyor = Surveyor(Territory(zoned(self.grid, self.zones), self.mission.types), homes, self.mission.goal)
        return surveyor.survey(self.robots, self.t_ms, self.meetings)


def check_moment(events: Sequence[log.MissionEvent], t_ms: int) -> None:
    """Raise UsageError if `t_ms` is before the start or after the end of the mission of these events."""
    begin_s, end_s = events[0].t_ms / 1000, events[-1].t_ms / 1000
    if not begin_s <= t_ms / 1000 <= end_s:
        raise UsageError(f"there is nothing at {t_ms / 1000:g} s: the mission goes from {begin_s:g} s to {end_s:g} s")


def moment_at(events: Sequence[log.MissionEvent], t_ms: int) -> Moment:
    """Return the moment `t_ms` of a mission, from at least all events up to then; UsageError if it is outside."""
    check_moment(events, t_ms)
    # replay the events before the last plan made at `t_ms`, or else all events up to `t_ms`
    end = bisect_right(events, t_ms, key=lambda event: event.t_ms)
    end = max((i for i in range(end) if isinstance(events[i], log.Planned) and events[i].t_ms == t_ms), default=end)
    made = events[end] if end < len(events) and events[end].t_ms == t_ms else None
    state, past = MissionTracker(), in_last_frame(events[:end])
    mission = log.started(past)
    for event in past:
        state.event(event)
    shifts = [event.shift for event in events[:end] if isinstance(event, log.FrameGrown)]
    grid = Grid(
        cells=state.cells,
        resolution_m=mission.resolution_m,
        origin_m=mission.origin_m,
        terrains=mission.terrains,
        chargers=mission.chargers,
        corner=Cell(-sum(shift.x for shift in shifts), -sum(shift.y for shift in shifts)),
    )
    # the log has charges at the times of plans only
    plans = [event for event in past if isinstance(event, log.Planned)]
    charges = dict(plans[-1].charges) if plans else {}
    return Moment(
        mission=mission,
        t_ms=t_ms,
        grid=grid,
        robots=tuple(_report(name, state.tracks, t_ms, charges.get(name)) for name in state.tracks),
        # a plan that took time was made with meeting points that only its own event has
        meetings=made.meetings if isinstance(made, log.Planned) else _in_use(past, state),
        zones=state.zones,
    )


def _report(name: str, tracks: Tracks, t_ms: int, charge: float | None) -> RobotReport:
    # the same values as `SimulatedWorld` and the worlds of real robots report
    track = tracks[name]
    cell, free_at_ms, carrier, heading = None, t_ms, track.where.carrier, None
    if carrier is None and track.where.at is not None:
        cell, passed_ms = track.where.at.ahead(t_ms)
        heading = track.where.at.heading(t_ms)
        heading = track.heading if heading is None else heading
        free_at_ms = max(t_ms, passed_ms)
    action = None if track.running is None else track.running.action
    if track.running is not None and action is not None and action.carrier is not None:
        rover = tracks[action.robot].kind
        took_ms = rover.dock_ms if action.name is ActionName.DOCK else rover.undock_ms
        free_at_ms = max(t_ms, track.running.t_ms + took_ms)
    if track.away is not None:  # it is reported where it is expected
        cell, free_at_ms, heading = track.away.cell, max(t_ms, track.away.wait_ms), None
    lost = track.lost or (carrier is not None and tracks[carrier].lost)
    return RobotReport(
        name=name,
        type=track.kind.name,
        cell=cell,
        carrier=carrier,
        free_at_ms=free_at_ms,
        lost=lost,
        heading=heading,
        speed=track.speed,
        charge=charge,
        away=None if track.away is None else track.away.targets,
    )


def _in_use(events: Sequence[log.MissionEvent], state: MissionTracker) -> tuple[log.MapMeeting, ...]:
    """Return the meeting points that the rest of the plan uses, and those where rovers were set down."""
    left: Sequence[Action] = ()
    deployments = Deployments()
    running: dict[str, Action] = {}
    away: set[str] = set()  # rovers out of contact follow what they were told, not this plan
    # the executor's queues, replayed: the unfinished actions of the current plan
    for event in events:
        dropped: set[str] = set()  # robots whose actions do not follow any more
        match event:
            case log.Planned():
                left = [action for action in event.actions if not away.issuperset(action.robots)]
            case log.ContactLost():
                away.add(event.robot)
                dropped = {event.robot}
            case log.ContactRegained():
                away.discard(event.robot)
                left = [*left, running[event.robot]] if event.robot in running else left
            case log.ActionStarted(action=action):
                running[action.robot] = action
            case log.ActionEnded(action=action, end=end):
                running.pop(action.robot, None)
                left = [other for other in left if other != action]
                if end is log.ActionEnd.DONE:
                    deployments.done(action)
                elif end is log.ActionEnd.BLOCKED:
                    dropped = {action.robot}
                elif end is log.ActionEnd.FAILED:
                    dropped = {*action.robots}
            case log.RobotLost():
                dropped = {event.robot}
        if dropped:
            left = [action for action in left if not set(action.robots) <= dropped]
    present = [track.running.action for track in state.tracks.values() if track.running is not None]
    docking = [action for action in present if action.carrier is not None]
    used = {action.place for action in (*left, *docking)} | set(deployments.at.values())
    return tuple(point for point in (state.plan.meetings if state.plan else ()) if point.name in used)
