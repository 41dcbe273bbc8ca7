"""Plans: time-stamped durative actions in integer milliseconds.

A robot takes part in one action at a time. Its next action starts at least `EPSILON_MS` after the end of the last one,
since in PDDL 2.1 an action that depends on the end of another has to start after it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from marsupial.model.arguments import instance, text, whole

EPSILON_MS = 1


class ActionName(StrEnum):
    """The four actions of the paper."""

    MOVE = "move"
    EXPLORE = "explore"
    DOCK = "dock"
    UNDOCK = "undock"


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """One durative action."""

    name: ActionName
    start_ms: int
    duration_ms: int
    robot: str  #: the robot that moves or explores; the rover of a dock or undock
    place: str  #: the place where it ends: a meeting or home (move), a target (explore), the meeting (dock, undock)
    carrier: str | None = None  #: the carrier of a dock or undock, else None
    origin: str | None = None  #: the place that a move or explore leaves, else None

    @property
    def end_ms(self) -> int:
        """End of the action."""
        return self.start_ms + self.duration_ms

    @property
    def robots(self) -> tuple[str, ...]:
        """All robots that take part."""
        return (self.robot,) if self.carrier is None else (self.robot, self.carrier)

    def __str__(self) -> str:
        middle = self.carrier if self.carrier is not None else self.origin
        return f"({self.name} {self.robot} {middle} {self.place})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Actions ordered by start, then by robot name."""

    actions: tuple[Action, ...]

    @classmethod
    def of(cls, actions: Iterable[Action]) -> Plan:
        """Return the plan of these actions, sorted."""
        # a total order, so that equal plans are written identically
        return cls(actions=tuple(sorted(actions, key=lambda a: (a.start_ms, a.robot, a.name, a.place))))

    @property
    def makespan_ms(self) -> int:
        """End of the last action; 0 for an empty plan."""
        return max((action.end_ms for action in self.actions), default=0)

    @property
    def explored(self) -> frozenset[str]:
        """Names of the targets it explores."""
        return frozenset(a.place for a in self.actions if a.name is ActionName.EXPLORE)

    def of_robot(self, robot: str) -> tuple[Action, ...]:
        """Return the actions of `robot` in order."""
        return tuple(action for action in self.actions if robot in action.robots)


def first_targets(actions: Iterable[Action]) -> dict[str, str]:
    """Return the first target of each robot that explores."""
    first: dict[str, str] = {}
    for action in actions:
        if action.name is ActionName.EXPLORE:
            first.setdefault(action.robot, action.place)
    return first


def checked_plan(name: str, value: object) -> Plan:
    """Return a third-party plan after checking its types; UsageError names the wrong part, prefixed with `name`."""
    plan = instance(name, value, Plan)
    for i, each in enumerate(instance(f"{name}.actions", plan.actions, tuple)):
        at = f"{name}.actions[{i}]"
        action = instance(at, each, Action)
        instance(f"{at}.name", action.name, ActionName)
        for key in ("robot", "place"):
            text(f"{at}.{key}", getattr(action, key))
        for key in ("carrier", "origin"):
            if getattr(action, key) is not None:
                text(f"{at}.{key}", getattr(action, key))
        for key in ("start_ms", "duration_ms"):
            whole(f"{at}.{key}", getattr(action, key))
    return plan
