"""Assignment one step ahead: each robot gets at most one target, at the least sum of exploration times.

At each replanning a Hungarian assignment decides among carriers that explore themselves, rovers on the ground, carriers
that deploy a rover aboard, and carriers that first retrieve one from the ground. Costs are the times at which targets
would be explored (`marsupial.strategies.outlook`). Later steps are not planned: a rover that was set down gets its next
target at a later replanning, like any other robot.

A rover with a target of its own is not retrieved. If several transports need a rover from the ground, only the earliest
is fixed and the others are assigned again. A robot without a target stands by (`Outlook.stand_by`). If no robot can
reach a target in any of these ways, list scheduling makes the plan.

Targets have no utility: subtracting seconds for the area that a target may reveal made missions longer.

References
----------
Burgard et al., Coordinated Multi-Robot Exploration, IEEE Transactions on Robotics 21(3), 2005; Stachniss, Robotic
Mapping and Exploration, 2009: robots and targets assigned by cost and utility, for identical robots.
"""

import numpy as np

from marsupial.model import Briefing, Plan
from marsupial.planning.greedy import serve
from marsupial.strategies.outlook import Outlook
from marsupial.strategies.rules import RuleStrategy


class OneStep(RuleStrategy):
    """The one-step assignment."""

    name = "assignment"

    def explore(self, briefing: Briefing) -> tuple[Plan, frozenset[str]]:
        outlook = Outlook(briefing.situation, briefing.previous)
        free = [robot.name for robot in outlook.situation.robots if robot.place is not None]
        left = np.ones(len(outlook.targets), dtype=np.bool_)
        while True:
            retrievable = frozenset(free)
            chosen = outlook.assign([[o.only(left) for o in outlook.options(r, retrievable=retrievable)] for r in free])
            if not chosen:
                break
            # two transports may need the same rover from the ground: then only the earliest is fixed
            for option, target in [pair for pair in chosen if not pair[0].retrieved] or chosen[:1]:
                outlook.take(option, target)
                left[target] = False
                free = [robot for robot in free if robot not in (option.robot, option.explorer)]
        if left.all():
            return serve(briefing.situation)
        outlook.stand_by(free)
        return outlook.plan, frozenset()
