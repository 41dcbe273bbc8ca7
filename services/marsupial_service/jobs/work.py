"""The worker's part of a job: analyse the map if there is one, search, check every plan, report better ones.

It runs in a worker (`marsupial.processes`), a separate process that the server ends at the job's limit.
"""

import json
import time
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace

from marsupial import native
from marsupial.errors import EngineUnavailable, InputError, UsageError
from marsupial.formats.pddl.plantext import write_plan_text
from marsupial.formats.situation import situation_to_json
from marsupial.library.first_use import trial_situation, try_planner
from marsupial.model.plan import Plan
from marsupial.model.planning import Budget, Finished, Improved, Outcome
from marsupial.model.situation import Situation
from marsupial.planning.checker import check
from marsupial.planning.engines import engine
from marsupial.planning.incumbent import Incumbent
from marsupial.processes.loading import report_compiling
from marsupial_service.analyses.maps import MapState, map_state_of
from marsupial_service.analyses.situations import situation_of
from marsupial_service.entries.documents import actions_text, line
from marsupial_service.jobs.records import Analysed, Closed, Found, WorkerTask
from marsupial_service.problems import HttpProblem, summary
from marsupial_service.schemas.enums import JobOutcome
from marsupial_service.schemas.requests import JobBody, SituationJobBody
from marsupial_service.settings import ServiceLimits

_LEAST_S = 0.05

_OUTCOMES: Mapping[Outcome, JobOutcome] = {
    Outcome.OPTIMAL: JobOutcome.OPTIMAL,
    Outcome.SATISFICING: JobOutcome.SATISFICING,
    Outcome.UNSOLVABLE: JobOutcome.UNSOLVABLE,
    Outcome.NO_PLAN: JobOutcome.NO_PLAN,
    Outcome.TIMEOUT: JobOutcome.TIMEOUT,
    Outcome.MEMORY: JobOutcome.OUT_OF_MEMORY,
    Outcome.CRASHED: JobOutcome.ENGINE_FAILED,
    Outcome.KILLED: JobOutcome.ENGINE_FAILED,
    Outcome.UNSUPPORTED: JobOutcome.UNSUPPORTED,
}
GAVE_UP = frozenset({JobOutcome.NO_PLAN, JobOutcome.TIMEOUT, JobOutcome.OUT_OF_MEMORY})
"""Outcomes of a job without a plan; a job with a plan ends as satisficing instead."""


def solve(work: WorkerTask) -> Iterator[Analysed | Found | Closed]:
    """Do the work: yield the analysis of the map, each better plan, and finally how it ended."""
    started_s = time.monotonic()
    try:
        task = task_in(work.source, work.limits)
        if isinstance(task, Situation):
            situation = task
        else:
            situation = task.situation()
            # before the search: clients may draw the map during planning
            yield Analysed(situation=situation_to_json(situation), places=line(task.places()))
        budget = work.budget
        if budget.seconds is not None:
            budget = replace(budget, seconds=max(_LEAST_S, budget.seconds - (time.monotonic() - started_s)))
        # this process is the worker already: the planner needs no process of its own
        steps = engine(work.engine).solve_here(situation, budget, start=work.start)
        yield from checked(steps, situation, work.start)
    except HttpProblem as error:  # the limits were larger when the job was accepted
        yield Closed(outcome=JobOutcome.INVALID_INPUT, detail=summary(error.errors, len(error.errors)))
    except InputError as error:
        yield Closed(outcome=JobOutcome.INVALID_INPUT, detail=str(error))
    except (EngineUnavailable, UsageError) as error:
        yield Closed(outcome=JobOutcome.UNSUPPORTED, detail=str(error))


def task_in(source: bytes, limits: ServiceLimits) -> Situation | MapState:
    """Return the situation or map state sent for a job. Raises InputError, HttpProblem."""
    sent = JobBody.model_validate(json.loads(zlib.decompress(source))).root
    if isinstance(sent, SituationJobBody):
        return situation_of(sent.situation, limits)
    return map_state_of(sent.map_state, limits)


def checked(steps: Iterator[Improved | Finished], situation: Situation, start: Plan | None) -> Iterator[Found | Closed]:
    """Yield the better plans and the end of a search; `start` is the best plan known before it."""
    incumbent = Incumbent(situation)
    if start is not None:
        incumbent.take(start)
    for step in steps:
        if isinstance(step, Finished):
            yield _closed(step, incumbent)
            return
        if incumbent.take(step.plan) and incumbent.value is not None:
            yield Found(
                score=incumbent.value,
                makespan_ms=step.plan.makespan_ms,
                actions=actions_text(step.plan),
                ipc=write_plan_text(step.plan, situation),
            )


def _closed(end: Finished, incumbent: Incumbent) -> Closed:
    """Convert the end of a search to the end of a job; a planner whose plan was invalid has proven nothing."""
    outcome, detail, bound_ms = _OUTCOMES[end.outcome], end.detail, end.lower_bound_ms
    has_plan = incumbent.plan is not None
    if incumbent.refused:
        outcome = JobOutcome.SATISFICING if has_plan else JobOutcome.ENGINE_FAILED
        detail, bound_ms = f"the planner returned an invalid plan: {incumbent.refused[-1]}", None
    elif not has_plan and outcome in (JobOutcome.OPTIMAL, JobOutcome.SATISFICING):
        outcome, detail = JobOutcome.ENGINE_FAILED, f"the planner reported a plan but returned none: {detail}"
    elif has_plan and (outcome in GAVE_UP or outcome is JobOutcome.UNSOLVABLE):
        outcome = JobOutcome.SATISFICING
    return Closed(outcome=outcome, detail=detail, lower_bound_ms=bound_ms)


def try_planning(_: object) -> bool:
    """Return whether planning gives a valid plan."""
    situation = trial_situation()
    plans = [e.plan for e in engine("greedy").solve(situation, Budget(steps=1)) if isinstance(e, Improved)]
    return bool(plans) and check(situation, plans[-1]).valid


PLANNERS = ("greedy", "anytime", "exact", "auto")


_watching = ExitStack()


def watch_compiling() -> None:
    """Report to the server which functions are compiled by whatever is loaded after this."""
    _watching.enter_context(native.watched(lambda name, done, most: report_compiling(done, most)))


def load_planners() -> None:
    """Load marsupial's own planners with their compiled code; the very first time, compiling takes half a minute."""
    # in the fork server, from which workers are forked: so their first plan takes milliseconds
    for planner in PLANNERS:
        try_planner(planner)
