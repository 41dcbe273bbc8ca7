"""What is told of a strategy; apart from `marsupial.model.strategy`, so that lists of strategies take no numpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class StrategyInfo:
    """What there is to say of a strategy, apart from its code.

    Parameters
    ----------
    team
        Which teams it leads, in words.
    asks_planner
        Whether it asks a planner.
    parameters
        What may follow its name, and the value of each if nothing is said; None for no limit.
    source
        The paper it comes from.
    missing
        What keeps it from being used here; None if nothing does.
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
        """The parameters as they follow the name, with their values if nothing is said."""
        return ", ".join(
            f"{name} ({'no limit' if value is None else f'{value:g}'})" for name, value in self.parameters.items()
        )
