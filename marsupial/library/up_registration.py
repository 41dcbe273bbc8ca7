"""Adds marsupial to the engines of unified-planning, a library that marsupial does without otherwise."""

NAME = "marsupial"  # the engine's name in unified-planning


def register_with_unified_planning(environment: object | None = None) -> None:
    """Add the engine ``marsupial`` to an environment of unified-planning, the global one by default.

    Then ``OneshotPlanner(name="marsupial")`` and ``AnytimePlanner(name="marsupial")`` solve problems of marsupial's
    domain; their parameters are ``planner``, ``"auto"`` by default, and ``steps`` for reproducible plans.
    """
    from unified_planning.environment import get_environment

    known = get_environment(environment).factory
    if NAME not in known.engines:
        known.add_engine(NAME, "marsupial.library.up_engine", "MarsupialEngine")
