"""A fake engine with scripted events, and briefings and plans for it."""

from collections.abc import Iterator
from dataclasses import replace

from marsupial.model.objective import MAKESPAN, Objective, ObjectiveName
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, EngineInfo, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.model.strategy import Briefing
from marsupial.planning.greedy import serve
from marsupial.planning.schedule.timeline import retime


class FakeEngine:
    """Yields given events and records its arguments."""

    info = EngineInfo(
        name="fake", summary="", licence="", anytime=True, proves_optimality=False, deterministic_steps=True
    )

    def __init__(self, *events: Improved | Finished) -> None:
        self._events = events
        self.asked: list[tuple[Situation, Budget, Plan | None]] = []
        self.objectives: list[ObjectiveName] = []

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.asked.append((situation, budget, start))
        self.objectives.append(objective.name)
        return iter(self._events)


class WithPrices(FakeEngine):
    """A fake that supports priced arrival."""

    info = replace(FakeEngine.info, objectives=(ObjectiveName.MAKESPAN, ObjectiveName.PRICED_ARRIVAL))


def found(*plans: Plan) -> list[Improved | Finished]:
    events: list[Improved | Finished] = [Improved(plan=plan, elapsed_s=i + 1.0) for i, plan in enumerate(plans)]
    return [*events, Finished(outcome=Outcome.SATISFICING, elapsed_s=9.0)]


def brief(situation: Situation, previous: Plan | None = None) -> Briefing:
    return Briefing(situation=situation, previous=previous, direct_ms=dict, connects={}, deployed_at={})


def in_order(situation: Situation, *targets: str) -> Plan:
    """Return the plan in which the carrier explores these targets of `one_hall` in that order."""
    plan, _ = serve(situation)
    action, place, actions = plan.actions[0], "c1_start", []
    for target in targets:
        actions.append(replace(action, origin=place, place=target))
        place = target
    return retime(situation, actions)
