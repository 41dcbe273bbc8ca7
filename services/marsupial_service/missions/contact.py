"""Which rovers are out of contact, as reports say: they can't be told anything until they are in contact again."""

from collections.abc import Mapping

from marsupial_service.missions.commanded import CommandedRobot
from marsupial_service.missions.pending import PendingNews
from marsupial_service.missions.values import MissionReport


class ReportedContact:
    """The rovers out of contact after a report, and those that the mission knows to be away since the last news."""

    def __init__(self) -> None:
        self._returns: dict[str, bool] = {}  # rovers out of contact, and whether they drive back by themselves
        self._away: set[str] = set()  # those on the ground, as of the last news

    def __contains__(self, name: str) -> bool:
        return name in self._returns

    def apply(self, report: MissionReport, robots: Mapping[str, CommandedRobot]) -> None:
        """Apply a report. Nothing more is to be heard of lost rovers, and those aboard are in contact."""
        self._returns |= {one.robot: one.returns for one in report.out_of_contact}
        for name in tuple(self._returns):
            if name in report.in_contact or robots[name].lost or robots[name].where.aboard:
                del self._returns[name]

    def note(self, robots: Mapping[str, CommandedRobot], news: PendingNews) -> None:
        """Add to news which rovers are away from now on, and which no more: while they dock, they are in contact.

        One that is reported to have failed has been heard of, and waits elsewhere than it was expected.
        """
        on_ground = (n for n in self._returns if (r := robots[n]).cell and (r.order is None or r.driving))
        before, self._away = self._away, set(on_ground)
        failed = {name for name, _ in (*news.failed, *news.declined)}
        news.in_contact = [n for n in robots if n in before and n not in self._away - failed]
        news.out_of_contact = [n for n in robots if n in self._away and n not in before - failed]
        news.returning = [n for n in news.out_of_contact if self._returns[n]]
