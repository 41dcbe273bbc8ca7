"""Moments of missions on built-in maps, kept as files: missions change as marsupial does, these don't."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from importlib.resources import files

from marsupial.formats.situation import situation_from_json
from marsupial.model.situation import Situation


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionMoment:
    """A moment of a mission with the greedy planner, `at_ms` after its start; the file is named after the instance.

    Parameters
    ----------
    rovers
        Of each carrier.
    recover
        The file asks for all rovers aboard at the end, which the mission at that moment did not yet.
    """

    scenario: str
    carriers: int
    rovers: int
    seed: int
    at_ms: int
    targets: int
    recover: bool = False

    @property
    def name(self) -> str:
        """Name of the instance."""
        return f"mission-{self.scenario}-{self.carriers}x{self.rovers}-{self.targets}"

    def situation(self) -> Situation:
        """Read the situation."""
        data = (files("marsupial.bench.suite") / "moments" / f"{self.name}.json.gz").read_bytes()
        return situation_from_json(gzip.decompress(data).decode())
