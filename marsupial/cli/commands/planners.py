"""`marsupial planners`: every engine, whether it can be used here and what it can do."""

from __future__ import annotations

from dataclasses import asdict

from marsupial.cli.options import JsonList


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
    rows = [
        (
            info.name,
            "yes" if info.missing is None else f"no: {info.missing}",
            info.licence,
            ", ".join(_abilities(info.anytime, info.proves_optimality, info.deterministic_steps)),
            ", ".join(info.objectives),
            info.summary,
        )
        for info in infos
    ]
    print_table(("planner", "available", "licence", "can", "objectives", "what it is"), rows)


def _abilities(anytime: bool, proves_optimality: bool, steps: bool) -> list[str]:
    words = {"improve plans": anytime, "prove the best": proves_optimality, "count steps": steps}
    return [word for word, able in words.items() if able] or ["one plan"]
