"""The engine that always answers: list scheduling of targets one by one, then of the rest of the goal.

Each step takes the target that can be explored soonest, by the insertion that does so
(`marsupial.planning.schedule.insertions`), and adds its actions to the timeline; rovers are then picked up and
carriers drive home (`marsupial.planning.schedule.recovery`). Its weakness is that it leaves far targets for the
end. So there are a few rounds; each gives the target that came last in the one before a head start of half the makespan
(the squeaky wheel gets the grease). The shortest plan is kept.

References
----------
D. Joslin and D. Clements, "Squeaky wheel" optimization, Journal of Artificial Intelligence Research 10, 1999.
"""

import time
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from marsupial.arrays import Ints
from marsupial.model import MAKESPAN, ActionName, Budget, Finished, Improved, Objective, Outcome, Plan, Situation
from marsupial.planning import infos
from marsupial.planning.reachability import hopeless_targets, impossible, reach
from marsupial.planning.schedule.costs import NEVER, Costs, Detours
from marsupial.planning.schedule.insertions import Insertions
from marsupial.planning.schedule.recovery import go_home, recover
from marsupial.planning.schedule.timeline import Timeline, follow, replay, transport

ROUNDS = 8  # most plans made; more of them gain little


class Greedy:
    """The engine; `clock` gives wall-clock seconds. One step of a budget is one round, of `ROUNDS` at most."""

    info = infos.GREEDY

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock

    def solve(
        self, situation: Situation, budget: Budget, *, objective: Objective = MAKESPAN, start: Plan | None = None
    ) -> Iterator[Improved | Finished]:
        self.info.require(objective)
        begun = self._clock()
        if start is not None:
            yield Improved(plan=start, elapsed_s=0.0)
        proof = None if start is not None else impossible(situation)
        if proof is not None:
            yield Finished(outcome=Outcome.UNSOLVABLE, detail=proof, elapsed_s=self._clock() - begun)
            return
        best, complaint = start, ""
        rounds = islice(Listing(situation).drafts(), min(ROUNDS, budget.steps or ROUNDS))
        for n, (plan, missed) in enumerate(rounds, 1):
            elapsed = self._clock() - begun
            complaint = complaint or missed
            if not missed and (best is None or plan.makespan_ms < best.makespan_ms):
                best = plan
                yield Improved(plan=best, elapsed_s=elapsed)
            # the first round always finishes; no other round begins that would end too late at the pace so far
            if budget.seconds is not None and elapsed * (n + 1) / n > budget.seconds:
                break
        yield Finished(
            outcome=Outcome.NO_PLAN if best is None else Outcome.SATISFICING,
            detail=complaint if best is None else "list scheduling, nothing proven",
            elapsed_s=self._clock() - begun,
        )


def serve(situation: Situation, start: Plan | None = None) -> tuple[Plan, frozenset[str]]:
    """Return a plan that reaches as much of the goal as it can, and the targets left out: see `Listing.serve`."""
    return Listing(situation).serve(start)


class Listing:
    """List scheduling in one situation; its lookup tables are made once."""

    def __init__(self, situation: Situation) -> None:
        self._detours = Detours(situation)
        self._costs = Costs(self._detours.situation)

    def serve(self, start: Plan | None = None) -> tuple[Plan, frozenset[str]]:
        """Return a plan that reaches as much of the goal as it can, and the names of the targets left out.

        The plan is feasible, but some rovers may stay on the ground and some carriers away from home. A feasible plan
        `start` is kept, and actions for the unfinished goals are appended.
        """
        plan = next(self.drafts(start))[0]
        return plan, frozenset(target.name for target in self._detours.situation.targets) - plan.explored

    def drafts(self, start: Plan | None = None) -> Iterator[tuple[Plan, str]]:
        """Yield, endlessly, a plan with the actions of `start` first, and which part of the goal it misses."""
        situation, costs = self._detours.situation, self._costs
        begun = Timeline.of(situation) if start is None else replay(situation, start)
        names = [target.name for target in situation.targets]
        head_start_ms = np.zeros(len(names), dtype=np.int64)
        while True:
            timeline, left = _explore(begun.copy(), costs, head_start_ms)
            explored = [action for action in timeline.actions if action.name is ActionName.EXPLORE]
            last = left[0] if left else max(explored, key=lambda a: a.end_ms).place if names else None
            complaint = _why_left(situation, left)
            goal = situation.goal
            if goal.aboard:
                timeline, trouble = recover(timeline, costs)
                complaint = complaint or trouble
            if goal.return_home:
                trouble = go_home(timeline)
                complaint = complaint or trouble
            yield self._detours.expanded(timeline.plan), complaint
            if last is None:
                return
            head_start_ms[names.index(last)] += timeline.plan.makespan_ms // 2 + 1


def _why_left(situation: Situation, left: list[str]) -> str:
    if not left:
        return ""
    reasons = hopeless_targets(situation, reach(situation))
    return reasons.get(left[0], f"list scheduling found no way to {left[0]}")


def _explore(timeline: Timeline, costs: Costs, head_start_ms: Ints) -> tuple[Timeline, list[str]]:
    """Explore every target that insertions can serve; return the timeline and the names of the others."""
    names = [target.name for target in timeline.situation.targets]
    explored = timeline.explored
    if explored.issuperset(names):
        return timeline, []
    insertions = Insertions(timeline, costs, np.array([name not in explored for name in names], dtype=np.bool_))
    while insertions.left.any():
        done, numbers = insertions.soonest()
        # A head start counts as if the target could be explored that much sooner.
        target = int(np.argmin(np.where(done < NEVER, done - head_start_ms, NEVER)))
        if done[target] < NEVER:
            robot, carrier = insertions.explorer(int(numbers[target]))
            if carrier is not None:
                transport(insertions.timeline, robot, insertions.journey(robot, carrier, target))
            insertions.timeline.explore(robot, names[target])
            insertions.advance()
            insertions.left[target] = False
            continue
        # No insertion with a single transport is left: try chains of them, which cost more to search.
        relayed = _relay_to_target(insertions, names)
        if relayed is None:
            break
        insertions = Insertions(relayed[0], costs, insertions.left)
        insertions.left[relayed[1]] = False
    return insertions.timeline, [name for name, left in zip(names, insertions.left, strict=True) if left]


def _relay_to_target(insertions: Insertions, names: list[str]) -> tuple[Timeline, int] | None:
    """Return the timeline with one more target explored after several transports in a row, or None."""
    options, known = [], insertions.arrivals
    for i in known.rovers:
        sortie = np.where(insertions.left, insertions.costs.sortie[known.kinds[i]], NEVER)
        if not (sortie < NEVER).any():
            continue
        times, transports = known.relay(i)
        done = times[:, None] + sortie
        meeting, target = (int(k) for k in np.unravel_index(int(np.argmin(done)), done.shape))
        if done[meeting, target] < NEVER:
            options.append((int(done[meeting, target]), i, meeting, target, transports))
    for _, i, meeting, target, transports in sorted(options, key=lambda option: option[:2]):
        rover = known.robots[i]
        timeline = insertions.timeline.copy()
        if follow(timeline, rover, meeting, transports) and timeline.can_drive(rover, names[target]):
            timeline.explore(rover, names[target])
            return timeline, target
    return None
