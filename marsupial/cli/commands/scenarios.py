"""`marsupial scenarios`: the built-in scenarios."""

from __future__ import annotations

from typing import Annotated

import typer


def scenarios(json: Annotated[bool, typer.Option("--json", help="Print a JSON list.")] = False) -> None:
    """List the built-in scenarios.

    Example: marsupial scenarios
    """
    from marsupial.cli.display.tables import print_json, print_table
    from marsupial.generators.builtin import SCENARIOS

    if json:
        print_json(
            [
                {"name": name, "width_m": entry.width_m, "height_m": entry.height_m, "summary": entry.summary}
                for name, entry in SCENARIOS.items()
            ]
        )
        return
    rows = [(name, f"{entry.width_m:g} x {entry.height_m:g} m", entry.summary) for name, entry in SCENARIOS.items()]
    print_table(("scenario", "size", "what it is"), rows)
