from __future__ import annotations

import logging

import pytest

from marsupial_service.store.outage import Outage


def test_what_is_wrong_is_logged_when_it_begins_and_when_it_is_over(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    outage = Outage("it is away")
    assert not outage.over()
    for reason in ("first", "second"):
        outage.met(reason)
        outage.met(reason)
        assert outage.over()
        assert not outage.over()
    assert [record.getMessage() for record in caplog.records] == ["it is away", "it is away: that is over"] * 2
    assert [getattr(record, "reason", None) for record in caplog.records] == ["first", None, "second", None]
