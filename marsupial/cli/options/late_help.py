"""Help that is completed when it is printed: finding the strategies means looking through installed packages."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperOption

STRATEGIES = "{strategies}"
"""Placeholder for the names of all strategies in the help of an option."""


class LateHelp(TyperCommand):
    """A command whose options may have the placeholder `STRATEGIES` in their help."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        self._complete_help()
        super().format_options(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        self._complete_help()
        return super().shell_complete(ctx, incomplete)

    def _complete_help(self) -> None:
        from marsupial.strategies.clairvoyant import CLAIRVOYANT
        from marsupial.strategies.registry import strategy_names

        names = f"{', '.join(strategy_names())}, or {CLAIRVOYANT}, which knows the map beforehand"
        for option in self.params:
            if isinstance(option, TyperOption) and option.help is not None:
                option.help = option.help.replace(STRATEGIES, names)
