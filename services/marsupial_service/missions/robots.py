"""Simulated robots in the process of their mission: they hear what is published, and say what is to be reported.

They are the client that `marsupial_service.missions.simulated` is, with nothing on the way. What they report comes back
as an input once it is stored. So a process that takes the place of another one has them do the same again.
"""

from __future__ import annotations

import json

from marsupial_service.intake.reading import digest_of
from marsupial_service.missions.reading import report_of
from marsupial_service.missions.simulated import SimulatedTeam
from marsupial_service.missions.values import Event, EventType, SimulatedBrief, Told
from marsupial_service.schemas.missions import ReportBody


class SimulatedRobots:
    """The robots of one mission."""

    def __init__(self, brief: SimulatedBrief) -> None:
        self._brief = brief
        self._team = SimulatedTeam(brief.truth, {kind.name: kind for kind in brief.kinds}, brief.robots)

    def hear(self, event: Event) -> Told | None:
        """Take in an event of the mission, and return the report that commands ask for."""
        if event.type is EventType.STATE:
            self._team.paused = json.loads(event.data)["state"] == "paused"
        if event.type is not EventType.COMMANDS:
            return None
        document = self._team.answer(json.loads(event.data))
        if document is None:
            return None
        return Told(report_of(ReportBody.model_validate(document), self._brief), digest_of(document))
