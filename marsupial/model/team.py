"""Who is where, and on whom: what driving, docking and undocking do to a robot.

A rover that begins to dock has its place on the carrier from then on: it takes up room there, and plans count it as
carried. It is aboard, and moves with its carrier, once it has docked; a docking that fails leaves it where it stands.
A rover that begins to be set down is on the ground from then on; if that fails it is aboard again.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

from marsupial.model.mission import ActionEnd
from marsupial.model.plan import Action, ActionName

P = TypeVar("P")


@dataclass(frozen=True, slots=True)
class Whereabouts(Generic[P]):
    """Where one robot is.

    Parameters
    ----------
    at
        Where it stands or drives; None while it is aboard.
    carrier
        The carrier that it has a place on: it is aboard, or docking.
    left
        The carrier that it was aboard when its last undocking began.
    """

    at: P | None
    carrier: str | None = None
    left: str | None = None

    @property
    def aboard(self) -> str | None:
        """The carrier that it is aboard, or None."""
        return self.carrier if self.at is None else None

    def begun(self, action: ActionName, at: P, carrier: str | None = None) -> Whereabouts[P]:
        """Return where it is from the beginning of an action of its own at a place."""
        if action is ActionName.DOCK:
            return Whereabouts(at, carrier)
        return Whereabouts(at, None, self.carrier)

    def ended(self, action: ActionName, end: ActionEnd) -> Whereabouts[P]:
        """Return where it is after an action; one that was not begun changes nothing."""
        docking = action is ActionName.DOCK and self.at is not None and self.carrier is not None
        if docking and end is ActionEnd.DONE:
            return Whereabouts(None, self.carrier)
        if docking and end is ActionEnd.FAILED:
            return Whereabouts(self.at)
        if action is ActionName.UNDOCK and end is ActionEnd.FAILED and self.left is not None:
            return Whereabouts(None, self.left)
        return self


def after(action: Action) -> Whereabouts[str]:
    """Return the place at which an action that is done leaves its robot; the rover, of a docking or undocking."""
    return Whereabouts(None, action.carrier) if action.name is ActionName.DOCK else Whereabouts(action.place)


@dataclass(slots=True)
class Deployments:
    """Undockings and dockings done so far, and the meeting point at which each rover on the ground was set down."""

    deployed: int = 0
    retrieved: int = 0
    at: dict[str, str] = field(default_factory=dict)

    def done(self, action: Action) -> None:
        """Enter an action that is done."""
        if action.name is ActionName.UNDOCK:
            self.deployed += 1
            self.at[action.robot] = action.place
        elif action.name is ActionName.DOCK:
            self.retrieved += 1
            self.at.pop(action.robot, None)
