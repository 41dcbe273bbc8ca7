"""`marsupial scenarios`: the built-in scenarios."""

from __future__ import annotations

from marsupial.cli.options.shared import JsonList


def scenarios(json: JsonList = False) -> None:
    """List the built-in scenarios.

    Example: marsupial scenarios
    """
    from marsupial.cli.display.tables import print_json, print_table
    from marsupial.generators.builtin import SCENARIOS

    if json:
        keys = ("width_m", "height_m", "summary")
        print_json([{"name": name, **{key: getattr(one, key) for key in keys}} for name, one in SCENARIOS.items()])
        return
    rows = [(name, f"{entry.width_m:g} x {entry.height_m:g} m", entry.summary) for name, entry in SCENARIOS.items()]
    print_table(("scenario", "size", "what it is"), rows)
