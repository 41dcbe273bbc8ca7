"""`marsupial strategies`, `planners` and `scenarios`: lists of the choices."""

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
    what = []
    for one in infos:
        summary = one.summary if one.missing is None else f"not available: {one.missing}"
        what.append((one.name, summary, one.team, "yes" if one.asks_planner else "no"))
    print_table(("strategy", "what it does", "team", "planner"), what)
    print_table(("strategy", "parameters", "source"), [(one.name, one.parameter_text, one.source) for one in infos])


def planners(json: JsonList = False) -> None:
    """List the planners, and why any of them can't be used.

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
    able = []
    for one in infos:
        words = ("yes" if can else "no" for can in (one.anytime, one.proves_optimality, one.deterministic_steps))
        able.append((one.name, *words, ", ".join(one.objectives), one.licence))
    print_table(("planner", "improves", "proves", "steps", "objectives", "licence"), able)


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
