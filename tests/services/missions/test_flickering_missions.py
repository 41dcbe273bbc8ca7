"""A mission by reports whose map loses the same cells again and again comes to its end."""

import json
from itertools import chain
from typing import Any

import pytest
from mission_house import Hosted, again, brief, team

from marsupial.formats.missionlog import parse_log
from marsupial.generators.builtin import builtin_scenario
from marsupial.model import FLOOR, UNKNOWN, Changed, Status
from marsupial_service.intake.missions import report_of
from marsupial_service.missions.values import MissionReport, PendingInput
from marsupial_service.schemas.missions import ReportBody
from marsupial_service.schemas.words import EventType

EVERY = 5
"""Reports from one loss to the next."""


@pytest.mark.parametrize("lasting", [1, 3])
def test_cells_that_are_unknown_again_every_few_reports_do_not_keep_a_mission_from_ending(lasting: int) -> None:
    asked, robots = brief(), team()
    truth = builtin_scenario("lobby").grid.cells.ravel()
    inputs: list[MissionReport] = []
    with Hosted(asked) as hosted:
        batches = [hosted.batch(PendingInput(input=None))]
        known: set[int] = set()
        while not batches[-1].over and len(inputs) < 2000:
            batch = [json.loads(e.data) for e in batches[-1].events if e.type is EventType.COMMANDS][-1]
            report = robots.answer(batch)
            assert report is not None
            blink(report, known, len(inputs), lasting, truth)
            inputs.append(report_of(ReportBody.model_validate(report), asked))
            batches.append(hosted.batch(PendingInput(input=inputs[-1])))
    lines = [event.data for batch in batches for event in batch.events if event.type is EventType.LOG]
    log = parse_log("".join(f"{line}\n" for line in lines).encode())
    assert (log.ended.status, len(log.ended.aboard)) == (Status.COMPLETE, 4)
    assert sum(isinstance(event, Changed) for event in log.events) > 5
    assert log.ended.t_ms < 300_000
    assert again(asked, inputs, batches) == batches


def blink(report: dict[str, Any], known: set[int], number: int, lasting: int, truth: Any) -> None:
    """Let the first four floor cells that were seen before be unknown in some reports, and known again after that."""
    cells = [index for index in sorted(known) if truth[index] == FLOOR][:4]
    told = {seen["robot"]: triples(seen["runs"]) for seen in report.get("revealed", ())}
    for runs in told.values():
        for start, length, _ in runs:
            known.update(range(start, start + length))
    if number < EVERY or number % EVERY not in (0, lasting):
        return
    code = UNKNOWN if number % EVERY == 0 else FLOOR
    told["carrier1"] = sorted([*told.get("carrier1", ()), *((index, 1, code) for index in cells)])
    report["revealed"] = [{"robot": robot, "runs": list(chain(*runs))} for robot, runs in told.items()]


def triples(runs: list[int]) -> list[tuple[int, ...]]:
    """Return start, length and code of each run."""
    return list(zip(*(iter(runs),) * 3, strict=True))
