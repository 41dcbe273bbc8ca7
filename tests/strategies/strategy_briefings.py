"""Briefings for tests of strategies without a planner, and their decisions."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from support.planning.drawn_situations import situations

from marsupial.model import UNREACHABLE, Briefing, Plan, Situation, SituationGoal, Strategy
from marsupial.planning.checker import check

Direct = Mapping[str, Mapping[str, int]]


def brief(
    situation: Situation,
    direct: Direct | None = None,
    connects: Mapping[str, frozenset[str]] | None = None,
    deployed_at: Mapping[str, str] | None = None,
    previous: Plan | None = None,
) -> Briefing:
    """Return a briefing on a situation; without `direct` no carrier has a way to any target."""
    return Briefing(
        situation=situation,
        previous=previous,
        direct_ms=lambda: direct or {},
        connects=connects or {},
        deployed_at=deployed_at or {},
    )


def robot_by_robot(strategy: Strategy, briefing: Briefing) -> list[str]:
    """Return the actions that a strategy decides on, in the order of the robots."""
    plan = strategy.decide(briefing).plan
    assert_possible(briefing.situation, plan)
    return [str(a) for robot in briefing.situation.robots for a in plan.actions if a.robot == robot.name]


def assert_possible(situation: Situation, plan: Plan) -> None:
    """Check that a plan can be carried out, even if it does not reach the goal."""
    verdict = check(replace(situation, goal=SituationGoal()), plan, targets=plan.explored)
    assert verdict.valid, verdict.violation


@st.composite
def briefings(draw: st.DrawFn) -> Briefing:
    """Draw a situation with arbitrary direct times, connections and meeting points of rovers."""
    situation = draw(situations())
    carriers = [r.name for r in situation.robots if r.type == "carrier"]
    targets = [t.name for t in situation.targets]
    direct = {c: {t: draw(st.integers(0, 20)) for t in targets if draw(st.integers(0, 3))} for c in carriers}
    connects = {m: frozenset(t for t in targets if draw(st.booleans())) for m in situation.meetings}
    ground = [r.name for r in situation.robots if r.type == "rover" and r.place is not None]
    deployed = {
        r: draw(st.sampled_from(situation.meetings)) for r in ground if situation.meetings and draw(st.booleans())
    }
    return brief(situation, direct, connects, deployed)


@st.composite
def torn_briefings(draw: st.DrawFn) -> Briefing:
    """Draw a briefing in whose travel tables some ways are missing, most of them in one direction only."""
    briefing = draw(briefings())
    situation = briefing.situation
    keep = np.random.default_rng(draw(st.integers(0, 1000)))
    tables = {
        kind: np.where(keep.random(table.shape) < 0.8, table, UNREACHABLE)
        for kind, table in situation.travel_ms.items()
    }
    return replace(briefing, situation=replace(situation, travel_ms=tables))
