"""An exhaustive search over all actions of all robots in any order, to compare planners with."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

from marsupial.model import Role, Situation


@dataclass(frozen=True)
class Moment:
    """A search state: the place or carrier of each robot, the time from which it is free, and the explored targets."""

    where: tuple[str, ...]
    ready: tuple[int, ...]
    explored: frozenset[str]


class Everything:
    """An exhaustive search over the actions of a team, by the checker's rules."""

    def __init__(self, situation: Situation) -> None:
        self.situation = situation
        self.names = [robot.name for robot in situation.robots]
        self.kinds = [situation.type_of(name) for name in self.names]
        self.carriers = {robot.name: i for i, robot in enumerate(situation.robots) if self.role(i) is Role.CARRIER}

    def role(self, i: int) -> Role:
        return self.kinds[i].role

    def beginning(self) -> Moment:
        robots = self.situation.robots
        free = {robot.name: robot.free_at_ms for robot in robots}
        return Moment(
            tuple(robot.place or robot.carrier or "" for robot in robots),
            tuple(free[robot.carrier or robot.name] for robot in robots),
            frozenset(),
        )

    def following(self, now: Moment) -> Iterator[tuple[Moment, int]]:
        """Yield the state after each possible action, and the time of its end."""
        for i, where in enumerate(now.where):
            if where in self.carriers:
                c = self.carriers[where]
                if now.where[c] in self.situation.meetings:
                    end = max(now.ready[i], now.ready[c]) + max(1, self.kinds[i].undock_ms)
                    yield self.changed(now, {i: (now.where[c], end + 1), c: (now.where[c], end + 1)}), end
                continue
            targets = [t.name for t in self.situation.targets if self.kinds[i].name in t.explorers]
            for place in (*self.situation.meetings, *self.situation.homes, *targets):
                travel = self.situation.travel(self.kinds[i].name, where, place)
                if travel is not None and place != where:
                    end = now.ready[i] + max(1, travel)
                    after = self.changed(now, {i: (place, end + 1)})
                    yield (replace(after, explored=after.explored | {place}) if place in targets else after), end
            for name, c in self.carriers.items() if self.role(i) is Role.ROVER else ():
                full = now.where.count(name) >= self.kinds[c].capacity or not self.has_seat(now, i, c)
                if now.where[c] == where and where in self.situation.meetings and not full:
                    end = max(now.ready[i], now.ready[c]) + max(1, self.kinds[i].dock_ms)
                    yield self.changed(now, {i: (name, end + 1), c: (where, end + 1)}), end

    def has_seat(self, now: Moment, i: int, c: int) -> bool:
        """Return whether a carrier has a seat for a rover, if it has seats."""
        seats, own = dict(self.kinds[c].seats), self.kinds[i].seats_as or self.kinds[i].name
        aboard = [kind for where, kind in zip(now.where, self.kinds, strict=True) if where == self.names[c]]
        return not seats or sum((kind.seats_as or kind.name) == own for kind in aboard) < seats.get(own, 0)

    def changed(self, now: Moment, changes: dict[int, tuple[str, int]]) -> Moment:
        where, ready = list(now.where), list(now.ready)
        for i, (place, free) in changes.items():
            where[i], ready[i] = place, free
        return Moment(tuple(where), tuple(ready), now.explored)

    def is_goal(self, now: Moment) -> bool:
        goal = self.situation.goal
        if len(now.explored) < len(self.situation.targets):
            return False
        if goal.recover_rovers or goal.return_home:
            aboard = (where in self.carriers for i, where in enumerate(now.where) if self.role(i) is Role.ROVER)
            if not all(aboard):
                return False
        return not goal.return_home or all(
            robot.home is None or where == robot.home
            for i, (robot, where) in enumerate(zip(self.situation.robots, now.where, strict=True))
            if self.role(i) is Role.CARRIER
        )

    def has_plan(self) -> bool:
        seen: set[tuple[object, ...]] = set()
        pending = [self.beginning()]
        while pending:
            now = pending.pop()
            if self.is_goal(now):
                return True
            if (now.where, now.explored) not in seen:
                seen.add((now.where, now.explored))
                pending += [after for after, _ in self.following(now)]
        return False

    def has_plan_before(self, makespan_ms: int) -> bool:
        """Return whether there is a plan with a shorter makespan."""
        seen: dict[tuple[object, ...], list[tuple[int, ...]]] = {}
        pending = [self.beginning()] if makespan_ms > 0 else []
        for now in pending:
            if self.is_goal(now):
                return True
            known = seen.setdefault((now.where, now.explored), [])
            if any(all(a <= b for a, b in zip(other, now.ready, strict=True)) for other in known):
                continue
            known.append(now.ready)
            pending += [after for after, end in self.following(now) if end < makespan_ms]
        return False


def reduced(situation: Situation, configurations: int = 3000) -> Situation:
    """Return the situation, reduced until exhaustive search is feasible."""
    for i in count():
        robots = len(situation.robots)
        places = len(situation.places) - robots / 2
        if 2 ** len(situation.targets) * places**robots <= configurations:
            return situation
        names = [r.name for r in situation.robots]
        carriers = {r.name for r in situation.of_role(Role.CARRIER)}
        if i % 3 == 0 and robots > 2:
            last = (
                next((n for n in reversed(names) if n not in carriers), names[-1])
                if robots - len(carriers) > 1
                else max(carriers)
            )
            kept = frozenset(r.name for r in situation.robots if last not in (r.name, r.carrier))
            situation = situation.restricted(robots=kept)
        elif i % 3 == 1:
            situation = situation.restricted(targets=frozenset(t.name for t in situation.targets[:-1][-3:]))
        else:
            situation = situation.restricted(meetings=frozenset(situation.meetings[:-1][:3]))
    raise AssertionError
