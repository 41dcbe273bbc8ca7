"""Makes unified-planning know marsupial as an engine."""

from __future__ import annotations

NAME = "marsupial"


def register_with_unified_planning(environment: object | None = None) -> None:
    """Add the engine ``marsupial`` to an environment of unified-planning, the global one by default.

    Then ``OneshotPlanner(name="marsupial")`` and ``AnytimePlanner(name="marsupial")`` solve problems of marsupial's
    domain; their parameters are ``planner``, ``"auto"`` by default, and ``steps`` for reproducible plans.
    """
    from unified_planning.environment import get_environment

    known = get_environment(environment).factory
    if NAME not in known.engines:
        known.add_engine(NAME, "marsupial.library.up_engine", "MarsupialEngine")
