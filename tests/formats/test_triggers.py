import pytest

from marsupial.formats.loglines import read_triggers, trigger_text
from marsupial.model.mission import Cause, Trigger


@pytest.mark.parametrize(
    ("text", "triggers"),
    [
        ("start", (Trigger(Cause.START),)),
        ("way blocked: c1, c2", (Trigger(Cause.WAY_BLOCKED, ("c1", "c2")),)),
        ("gone: t1; new: t2, t3", (Trigger(Cause.GONE, ("t1",)), Trigger(Cause.NEW, ("t2", "t3")))),
        ("failed: c1; failed: r1", (Trigger(Cause.FAILED, ("c1",)), Trigger(Cause.FAILED, ("r1",)))),
    ],
)
def test_what_asks_for_a_plan_is_written_in_words_and_read_again(text: str, triggers: tuple[Trigger, ...]) -> None:
    assert trigger_text(triggers) == text
    assert read_triggers(text) == triggers


@pytest.mark.parametrize("text", ["", "; ", "start: ", "gone:", "somebody else's words; start", "other: a"])
def test_other_words_are_kept_as_they_are(text: str) -> None:
    assert trigger_text(read_triggers(text)) == text
