"""`marsupial strategies`: every strategy, which teams it leads, its parameters and where it comes from."""

from __future__ import annotations

from dataclasses import asdict

from marsupial.cli.options.shared import JsonList


def strategies(json: JsonList = False) -> None:
    """List the strategies, those of installed packages included.

    Parameters are given behind the name, as in --strategy bidding/W_n=1/W_p=0.5.

    Example: marsupial strategies
    """
    from marsupial.cli.display.tables import print_json, print_table
    from marsupial.strategies.registry import strategy_infos

    infos = strategy_infos()
    if json:
        print_json([{**asdict(info), "available": info.missing is None} for info in infos])
        return
    what = [
        (
            one.name,
            one.summary if one.missing is None else f"not available: {one.missing}",
            one.team,
            "yes" if one.asks_planner else "no",
        )
        for one in infos
    ]
    print_table(("strategy", "what it does", "team", "planner"), what)
    print_table(("strategy", "parameters", "source"), [(one.name, one.parameter_text, one.source) for one in infos])
