"""`marsupial planners`: every engine, whether it can be used here and what it can do."""

from __future__ import annotations

from dataclasses import asdict

from marsupial.cli.options.shared import JsonList


def planners(json: JsonList = False) -> None:
    """List the planners and what keeps any from being used.

    Example: marsupial planners
    """
    from marsupial.cli.display.tables import print_json, print_table
    from marsupial.planning.engines import engine_infos

    infos = engine_infos()
    if json:
        print_json([{**asdict(info), "available": info.missing is None} for info in infos])
        return
    what = [(one.name, "yes" if one.missing is None else f"no: {one.missing}", one.summary) for one in infos]
    print_table(("planner", "available", "what it is"), what)
    able = [
        (
            one.name,
            *("yes" if able else "no" for able in (one.anytime, one.proves_optimality, one.deterministic_steps)),
            ", ".join(one.objectives),
            one.licence,
        )
        for one in infos
    ]
    print_table(("planner", "improves", "proves", "steps", "objectives", "licence"), able)
