"""Values that an earlier version has stored are found under the names that their classes have now."""

from __future__ import annotations

import pickle

import pytest

from marsupial.model.scenario import MissionLimits
from marsupial_service.missions.values import Control, MissionReport
from marsupial_service.store import kept

FORMER = {
    b"cmarsupial_service.missions.values\n": b"cservices.missions.values\n",
    b"cmarsupial.model.scenario\nMissionLimits\n": b"cmarsupial.model.scenario\nLimits\n",
}


@pytest.mark.parametrize("value", [Control.PAUSE, MissionReport(n=1, t_ms=5, finished=(1,)), MissionLimits(time_ms=7)])
def test_what_was_stored_under_former_names_is_read(value: object) -> None:
    data = pickle.dumps(value, protocol=0)
    for name, former in FORMER.items():
        data = data.replace(name, former)
    with pytest.raises((ModuleNotFoundError, AttributeError)):
        pickle.loads(data)
    assert repr(kept.loads(data)) == repr(value)


def test_what_is_stored_now_is_read() -> None:
    report = MissionReport(n=2, t_ms=9, lost=(("joey", "battery"),))
    assert repr(kept.loads(kept.dumps(report))) == repr(report)
