"""Descriptions of strategies, separate from `marsupial.model.strategy` so that listing them needs no numpy."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class StrategyInfo:
    """Description of a strategy."""

    name: str
    summary: str
    team: str = "any"  # the teams that it can lead, in words
    asks_planner: bool = False
    # parameters that may follow its name, with their defaults; None for no limit
    parameters: Mapping[str, float | None] = field(default_factory=dict)
    source: str = ""  # the paper that it comes from
    missing: str | None = None  # why it can't be used here, or None

    @property
    def parameter_text(self) -> str:
        """The parameters with their defaults, as text."""
        defaults = {name: "no limit" if value is None else f"{value:g}" for name, value in self.parameters.items()}
        return ", ".join(f"{name} ({default})" for name, default in defaults.items())
