"""The log of a mission: which events its news makes.

The log holds the map as it is reported, so that a mission can be replayed as its robots reported it. The events of
actions are those of the executor (`marsupial.mission.executor`).
"""

from marsupial.maps.survey import Survey
from marsupial.mission.belief.belief import Belief
from marsupial.mission.observer import Observer
from marsupial.model import News, Plan, Reasons, RobotReport, Triggers
from marsupial.model import mission as log
from marsupial.model.runs import runs_of
from marsupial.paths.routes import steps_of


class MissionJournal:
    """Tells an observer of the news of a belief, and of plans."""

    def __init__(self, belief: Belief, observer: Observer) -> None:
        self._belief, self._write = belief, observer.event

    def heard(self, news: News) -> None:
        """Write who is in contact again, what is seen, and how robots drive."""
        for name in news.in_contact:
            self._write(log.ContactRegained(t_ms=news.t_ms, robot=name))
        if news.moved is not None:
            grid, shift = self._belief.grid, news.moved.by
            self._write(
                log.FrameGrown(
                    t_ms=news.t_ms, width=grid.width, height=grid.height, origin_m=grid.origin_m, shift=shift
                )
            )
        for change in news.zones:
            self._write(log.ZoneChanged(t_ms=news.t_ms, name=change.name, zone=change.zone))
        reported, grid = self._belief.reported, self._belief.world.grid
        for kind, seen in ((log.Revealed, reported.revealed), (log.Changed, reported.changed)):
            for name, indices in seen:
                self._write(kind(t_ms=news.t_ms, robot=name, runs=runs_of(indices, grid.cells.ravel())))
        for name, share in news.slowed:
            self._write(log.SpeedChanged(t_ms=news.t_ms, robot=name, share=share))
        for name, cells in news.passages:
            if len(cells) == 1:
                self._write(log.DriveEnded(t_ms=news.t_ms, robot=name, cell=cells[0]))
            else:
                self._write(log.DriveStarted(t_ms=news.t_ms, robot=name, cell=cells[0], steps=steps_of(cells)))

    def lost(self, news: News) -> None:
        """Write which robots are lost."""
        for name, reason in news.lost:
            self._write(log.RobotLost(t_ms=news.t_ms, robot=name, reason=reason))

    def returned(self, news: News) -> None:
        """Write which lost robots can act again."""
        for name in news.returned:
            self._write(log.RobotReturned(t_ms=news.t_ms, robot=name))

    def parted(self, robot: RobotReport) -> None:
        """Write where a rover that is out of contact now will wait."""
        assert robot.cell is not None, "rovers aboard are in contact"
        assert robot.away is not None, "it is out of contact"
        t_ms, targets = self._belief.now_ms, robot.away
        self._write(
            log.ContactLost(t_ms=t_ms, robot=robot.name, cell=robot.cell, wait_ms=robot.free_at_ms, targets=targets)
        )

    def planned(self, revision: int, triggers: Triggers, survey: Survey, plan: Plan, reasons: Reasons) -> None:
        """Write a plan (absolute times) that is followed from now on."""
        self._write(
            log.Planned(
                t_ms=self._belief.now_ms,
                revision=revision,
                trigger=triggers,
                targets=tuple(target.on_map() for target in survey.targets),
                meetings=survey.meetings,
                actions=plan.actions,
                charges=tuple((r.name, round(r.charge, 3)) for r in self._belief.robots() if r.charge is not None),
                guess=reasons.guess,
                compared=reasons.compared,
                instead=reasons.instead,
            )
        )
