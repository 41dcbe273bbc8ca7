"""The triggers of a replanning as text, such as ``gone: t1; new: t2, t3``, for mission logs and people."""

from __future__ import annotations

from marsupial.model.mission import Cause, Trigger, Triggers


def trigger_text(triggers: Triggers) -> str:
    """Return triggers as text."""
    return "; ".join(_words(trigger) for trigger in triggers)


def read_triggers(text: str) -> Triggers:
    """Return the triggers that a text lists; any other text becomes one trigger with `Cause.OTHER`."""
    triggers = tuple(_trigger(words) for words in text.split("; "))
    return triggers if trigger_text(triggers) == text else (Trigger(Cause.OTHER, (text,)),)


def _words(trigger: Trigger) -> str:
    names = ", ".join(trigger.names)
    if trigger.cause is Cause.OTHER:
        return names
    return f"{trigger.cause}: {names}" if names else str(trigger.cause)


def _trigger(words: str) -> Trigger:
    cause, _, names = words.partition(": ")
    if cause not in set(Cause):
        return Trigger(Cause.OTHER, (words,))
    return Trigger(Cause(cause), tuple(names.split(", ")) if names else ())
