"""The common part of all encodings: the actions that exist, interchangeable robots, scarce places aboard.

An engine gets no action that is never feasible: only drives along existing paths between places the robot can ever
reach, only docks where both robots can be. A drive out of a start is longer by the time until the robot is free, so
that every robot is free at 0. Rovers of one type that wait aboard one carrier are interchangeable and are set down in a
fixed order. Each target is explored once: passing over it a second time saves nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product

from marsupial.arrays import Flags
from marsupial.model import Action, ActionName, Plan, RobotState, Role, Situation
from marsupial.planning.reachability import reach

ALL = "all"  # the count of all rovers aboard, whatever their type


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchRequest:
    """The input of a planner's child process: the situation, its time in seconds, and a known plan."""

    situation: Situation
    seconds: float
    start: Plan | None = None


class Vocabulary:
    """The actions of a situation that can ever be feasible, each with its duration and start 0."""

    def __init__(self, situation: Situation) -> None:
        self.situation = situation
        self.carriers = situation.of_role(Role.CARRIER)
        self.rovers = situation.of_role(Role.ROVER)
        self._reached: Mapping[str, Flags] = reach(situation)

    def can_be(self, robot: str, place: str) -> bool:
        """Return whether `robot` could ever get to `place`."""
        return bool(self._reached[robot][self.situation.place_index[place]])

    def drives(self, robot: RobotState) -> Iterator[Action]:
        """Yield every move and explore of a robot."""
        places = [target.name for target in self.situation.targets if robot.type in target.explorers]
        places += self.situation.meetings
        origins = [] if robot.place is None else [robot.place]
        origins += [place for place in places if self.can_be(robot.name, place)]
        home = self.home(robot)
        for goal in places if home is None else [*places, home]:
            drives = (self._drive(robot, origin, goal) for origin in origins if origin != goal)
            yield from filter(None, drives)

    def meets(self) -> Iterator[Action]:
        """Yield every dock and undock."""
        for rover, carrier, meeting in product(self.rovers, self.carriers, self.situation.meetings):
            fits = self.situation.most_aboard(carrier.name, rover.name) > 0
            if fits and self.can_be(carrier.name, meeting) and self.can_be(rover.name, meeting):
                kind = self.situation.type_by_name[rover.type]
                meet = partial(Action, start_ms=0, robot=rover.name, carrier=carrier.name, place=meeting)
                yield meet(name=ActionName.UNDOCK, duration_ms=max(1, kind.undock_ms))
                yield meet(name=ActionName.DOCK, duration_ms=max(1, kind.dock_ms))

    def capacity(self, carrier: RobotState) -> int:
        return self.situation.type_by_name[carrier.type].capacity

    def scarce(self, carrier: RobotState, rover: RobotState) -> dict[str, int]:
        """Return the counts that limit whether `rover` can dock, each with its limit: of all rovers, of its seats."""
        limits = {ALL: self.capacity(carrier)}
        if (most := self.situation.most_aboard(carrier.name, rover.name)) < limits[ALL]:
            limits[self._seat(rover)] = most
        return {group: limit for group, limit in limits.items() if limit < len(self._of_group(group))}

    def all_scarce(self, carrier: RobotState) -> dict[str, int]:
        """Return the same for all rovers that fit on a carrier."""
        limits: dict[str, int] = {}
        for rover in self.rovers:
            if self.situation.most_aboard(carrier.name, rover.name):
                limits |= self.scarce(carrier, rover)
        return limits

    def load(self, carrier: RobotState, group: str) -> int:
        """Return the number of rovers aboard now that a count counts."""
        return sum(rover.carrier == carrier.name for rover in self._of_group(group))

    def _seat(self, rover: RobotState) -> str:
        return f"seats of {self.situation.type_by_name[rover.type].seat}"

    def _of_group(self, group: str) -> list[RobotState]:
        return [rover for rover in self.rovers if group in (ALL, self._seat(rover))]

    def predecessors(self) -> dict[str, str]:
        """Return, per rover, the interchangeable one that has to be set down before it."""
        before: dict[str, str] = {}
        last: dict[tuple[str, str, int], str] = {}
        for rover in self.rovers:
            if rover.carrier is not None:
                key = (rover.carrier, rover.type, rover.free_at_ms)
                if key in last:
                    before[rover.name] = last[key]
                last[key] = rover.name
        return before

    def home(self, robot: RobotState) -> str | None:
        """Return where the robot has to end, if anywhere."""
        carrier = self.situation.type_by_name[robot.type].role is Role.CARRIER
        return robot.home if carrier and self.situation.goal.return_home else None

    def _drive(self, robot: RobotState, origin: str, goal: str) -> Action | None:
        travel = self.situation.travel(robot.type, origin, goal)
        rover, meetings = self.situation.type_by_name[robot.type].role is Role.ROVER, self.situation.meetings
        # With one carrier, a rover at a meeting could have been set down at any other.
        useless = rover and len(self.carriers) == 1 and origin in meetings and goal in meetings
        if travel is None or useless:
            return None
        return Action(
            name=ActionName.EXPLORE if goal in self.situation.target_by_name else ActionName.MOVE,
            start_ms=0,
            duration_ms=max(1, travel + (robot.free_at_ms if origin == robot.place else 0)),
            robot=robot.name,
            origin=origin,
            place=goal,
        )
