"""The words of a mission log for what asked for a new plan, such as ``gone: t1; new: t2, t3``."""

from __future__ import annotations

from marsupial.model.mission import Cause, Trigger, Triggers


def trigger_text(triggers: Triggers) -> str:
    """Return what asked for a plan in words."""
    return "; ".join(_words(trigger) for trigger in triggers)


def read_triggers(text: str) -> Triggers:
    """Return what these words mean; what is none of ours is kept as it is."""
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
