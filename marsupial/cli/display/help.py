"""The help of a command, in plain text.

typer groups options only in the panels of rich, one for each `rich_help_panel`. Here that is a heading of plain text,
and stands at the first option of its group: those after it follow, options that several commands share among them.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperCommand

F = TypeVar("F", bound=Callable[..., Any])


class PlainCommand(TyperCommand):
    """A command whose help has its options in groups, and its arguments without braces."""

    # Any: the classes of contexts and formatters are private to typer, or those of click, by its version.
    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words of the usage line: ``SCENARIO`` for an argument that typer writes as ``{SCENARIO}``."""
        return [piece.strip("{}") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the arguments, then the options below the headings of their groups."""
        groups: dict[str, list[tuple[str, str]]] = {"Arguments": []}
        heading = "Options"
        for parameter in self.get_params(ctx):
            if (record := parameter.get_help_record(ctx)) is None:
                continue
            if parameter.param_type_name == "argument":
                groups["Arguments"].append(record)
                continue
            heading = getattr(parameter, "rich_help_panel", None) or heading  # click's own --help has none
            groups.setdefault(heading, []).append(record)
        for name, records in groups.items():
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)


class PlainProgram(typer.Typer):
    """A program, or a group of commands, all of which have such help."""

    def command(self, name: str | None = None, **options: Any) -> Callable[[F], F]:
        return super().command(name, cls=PlainCommand, **options)
