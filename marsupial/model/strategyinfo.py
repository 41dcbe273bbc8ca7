"""Descriptions of strategies, apart from `marsupial.model.strategy` so that listing them needs no numpy."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class StrategyInfo:
    """Description of a strategy.

    Parameters
    ----------
    team
        The teams that it can lead, in words.
    asks_planner
        Whether it asks a planner.
    parameters
        Parameters that may follow its name, with their defaults; None for no limit.
    source
        The paper that it comes from.
    missing
        Why it can't be used here, or None.
    """

    name: str
    summary: str
    team: str = "any"
    asks_planner: bool = False
    parameters: Mapping[str, float | None] = field(default_factory=dict)
    source: str = ""
    missing: str | None = None

    @property
    def parameter_text(self) -> str:
        """The parameters with their defaults, as text."""
        return ", ".join(
            f"{name} ({'no limit' if value is None else f'{value:g}'})" for name, value in self.parameters.items()
        )
