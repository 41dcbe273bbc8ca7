"""Where each robot is, and on which carrier: the effects of driving, docking and undocking.

A rover takes up a place on the carrier from the start of its docking, and plans count it as carried. It is aboard and
moves with the carrier from the end of the docking; if the docking fails, or one of the two is lost, it stays where it
stands. A rover is on the ground from the start of its undocking; if the undocking fails, it is aboard again.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

from marsupial.model.mission import ActionEnd
from marsupial.model.plan import Action, ActionName

P = TypeVar("P")


@dataclass(frozen=True, slots=True)
class Whereabouts(Generic[P]):
    """Where one robot is."""

    at: P | None  # where it stands or drives; None while it is aboard
    carrier: str | None = None  # the carrier on which it has a place, aboard or docking
    left: str | None = None  # the carrier from which its last undocking began

    @property
    def aboard(self) -> str | None:
        """The carrier if it is aboard, or None."""
        return self.carrier if self.at is None else None

    def begun(self, action: ActionName, at: P, carrier: str | None = None) -> Whereabouts[P]:
        """Return its whereabouts from the start of its docking or undocking at a place."""
        if action is ActionName.DOCK:
            return Whereabouts(at, carrier)
        return Whereabouts(at, None, self.carrier)

    def ended(self, action: ActionName, end: ActionEnd) -> Whereabouts[P]:
        """Return its whereabouts after an action; an action that did not start changes nothing."""
        # `at` and `carrier` are both set only from the start of a docking to its end
        docking = action is ActionName.DOCK and self.at is not None and self.carrier is not None
        if docking and end is ActionEnd.DONE:
            return Whereabouts(None, self.carrier)
        if docking and end in (ActionEnd.FAILED, ActionEnd.LOST):
            return Whereabouts(self.at)
        if action is ActionName.UNDOCK and end is ActionEnd.FAILED and self.left is not None:
            return Whereabouts(None, self.left)
        return self


def after(action: Action) -> Whereabouts[str]:
    """Return the whereabouts of an action's robot (a docking's or undocking's rover) after the action is done."""
    return Whereabouts(None, action.carrier) if action.name is ActionName.DOCK else Whereabouts(action.place)


@dataclass(slots=True)
class Deployments:
    """Counts finished undockings and dockings; `at` has the meeting point where each rover was set down."""

    deployed: int = 0
    retrieved: int = 0
    at: dict[str, str] = field(default_factory=dict)

    def done(self, action: Action) -> None:
        """Count an action that is done."""
        if action.name is ActionName.UNDOCK:
            self.deployed += 1
            self.at[action.robot] = action.place
        elif action.name is ActionName.DOCK:
            self.retrieved += 1
            self.at.pop(action.robot, None)
