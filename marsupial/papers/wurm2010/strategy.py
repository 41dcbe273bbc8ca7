"""The method of the paper: the shortest plan for the known targets, recomputed at each replanning.

Section III-C makes a planning problem of the targets and meeting points of the map so far; the goal is to explore all
targets, and robots follow the plan that ends first. The method assumes nothing about unknown cells, and compares the
planner's plan with no other. `marsupial.strategies.temporal` describes the additions of `temporal`.

What the text leaves open
-------------------------
- Of plans that end at the same time, the previous one is kept; list scheduling appends new targets to it. This favours
  the method: plans made from scratch each time change goals and take longer.
- The problem omits targets that no robot can serve, as it would have no solution otherwise.
- If the planner has no plan in time, robots likewise follow the previous one: they never wait for a planner. Targets
  that the planner's plan omits (big situations are split for some planners) are added in the same way.
- Once no target is left, robots follow the shortest plan that recovers the rovers or brings the team home.

References
----------
Wurm et al. 2010, sections III-A (the loop), III-C (the planning problem) and III-D (the planner
minimises the makespan).
"""

from marsupial.model import MAKESPAN, Briefing
from marsupial.planning.greedy import Listing
from marsupial.strategies.asking import Explored, PlanningStrategy, completed, shortest, without


class ShortestPlan(PlanningStrategy):
    """Follows the shortest plan that the engine finds for the known targets."""

    name = "wurm2010"

    def explore(self, briefing: Briefing) -> Explored:
        """Return the shortest plan for the known targets, the targets that no robot can serve, the report."""
        listing, previous = Listing(briefing.situation), briefing.previous
        spare, unserved = listing.serve(previous)
        situation = without(briefing.situation, unserved)
        kept = None if previous is None else shortest(situation, [(spare, unserved)])
        asked, report = self.ask(situation, MAKESPAN, kept)
        found = completed(listing, kept, asked) or [(spare, unserved)]
        # the first of equals: the previous plan
        plan, unserved = min(found, key=lambda served: (len(served[1]), served[0].makespan_ms))
        return Explored(plan, unserved, report)
