from __future__ import annotations

from contextlib import suppress

import pytest
from lost_answers import LostAnswers
from mission_house import Driver, brief, open_missions, team
from undisturbed import undisturbed

from marsupial_service.store import StoreError


@pytest.mark.parametrize("lost", ["turns = ?", "INSERT INTO missions"])
async def test_a_mission_of_which_a_server_has_stored_more_than_it_was_told_goes_on(place: str, lost: str) -> None:
    async with open_missions(place) as missions:
        answers = LostAnswers(missions._store, lost, 1)
        while True:
            with suppress(StoreError):
                record, _ = await missions.create(brief(), b"same", owner="me", idempotency_key="key")
                break
        assert await Driver(team()).drive(missions, record)
        assert not answers.left or lost == "INSERT INTO missions"
        log = await missions.log(record)
    assert log == undisturbed("lobby")
