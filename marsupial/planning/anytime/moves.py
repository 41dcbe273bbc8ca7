"""Random changes to the candidate list, compiled. Each says whether it made one; most of them can't be carried out.

A change of rides and the targets they serve has to be one move, or no path leads from plan to plan: so targets are
taken out together with the rides that were there for them alone, and put back with whatever rides they need.
"""

from __future__ import annotations

from marsupial.planning.anytime.encoding import (
    AT,
    CARRIERS,
    DOCK,
    ENTRIES,
    EXITS,
    EXPLORE,
    MEETINGS,
    NEVER,
    ROVERS,
    START,
    TARGETS,
    TYPE,
    UNDOCK,
    Task,
)
from marsupial.planning.anytime.kernel import (
    LONGEST_SEGMENT,
    SIZE,
    TAKEN,
    Search,
    after_carrier,
    compiled,
    door,
    draw,
    erase,
    find,
    insert,
    next_event,
    outing_end,
    pick,
)

TRIES = 8


@compiled
def _late_target(task: Task, search: Search) -> int:
    """Return a random target, those reached late more often."""
    one = pick(task, search, TARGETS)
    other = pick(task, search, TARGETS)
    return one if search.reached[0, one] >= search.reached[0, other] else other


@compiled
def _tidy(task: Task, search: Search, rover: int) -> None:
    """Take out rides of a rover that have become useless."""
    events = search.lists[1]
    before, at = -1, next_event(search, -1, rover)
    while True:
        if at < 0:
            if before < 0 or events[before, 0] in (EXPLORE, START) or task.recover:
                return
            erase(search, before, 1)
        elif (
            events[at, 0] == DOCK
            and before >= 0
            and events[before, 0] == UNDOCK
            and (events[at, 2] == events[before, 2] or draw(search.seed, 2) == 0)
        ):
            erase(search, at, 1)
            erase(search, before, 1)
        else:
            before, at = at, next_event(search, at, rover)
            continue
        before, at = -1, next_event(search, -1, rover)


@compiled
def _take(task: Task, search: Search) -> int:
    """Take a target, or a few that follow each other, out of the candidate into `held`; return how many."""
    at = find(search, _late_target(task, search))
    events, robot = search.lists[1], search.lists[1][at, 1]
    end = outing_end(task, search, at)
    choice = draw(search.seed, 4)
    if choice == 0:  # the whole outing
        while events[at - 1, 0] == EXPLORE and events[at - 1, 1] == robot:
            at -= 1
    elif choice < 3:
        end = at + 1
    count = min(end - at, LONGEST_SEGMENT)
    for i in range(count):
        search.lists[TAKEN, i, 0] = events[at + i, 3]
    erase(search, at, count)
    _tidy(task, search, robot)
    return count


@compiled
def _put(search: Search, at: int, robot: int, count: int) -> None:
    """Insert the targets held, in their order or the other way round."""
    forward = count < 2 or draw(search.seed, 2) == 0
    for i in range(count):
        place = search.lists[TAKEN, i if forward else count - 1 - i, 0]
        insert(search, at + i, EXPLORE, robot, -1, place)


@compiled
def _relocate(task: Task, search: Search) -> bool:
    """Give targets to a robot that is about anyway."""
    count = _take(task, search)
    events, target = search.lists[1], search.lists[TAKEN, 0, 0]
    neighbours = task.near[target]
    for attempt in range(TRIES):
        at = -1
        if attempt < 2:
            other = neighbours[draw(search.seed, len(neighbours))]
            at = find(search, other) if other >= 0 else -1
        if at < 0:
            at = draw(search.seed, search.tallies[1, SIZE])
        robot = events[at, 1]
        if events[at, 0] == DOCK or (events[at, 0] == UNDOCK and draw(search.seed, 3) == 0):
            robot = events[at, 2]
        if events[at, 3] < 0 or task.leg[task.robots[robot, TYPE], events[at, 3], target] >= NEVER:
            continue
        before = events[at, 0] == EXPLORE and draw(search.seed, 2) == 0
        _put(search, at if before else at + 1, robot, count)
        return True
    return False


@compiled
def _deploy(task: Task, search: Search) -> bool:
    """Take a rover to targets: set it down on the way, or pick it up elsewhere first."""
    if not task.groups[ROVERS, 0] or not task.groups[CARRIERS, 0]:
        return False
    count = _take(task, search)
    first = search.lists[TAKEN, 0, 0]
    rover = pick(task, search, ROVERS)
    entry = door(search, task.doors[ENTRIES, task.robots[rover, TYPE], first])
    if entry < 0:
        return False
    at, seen, i = -1, 0, next_event(search, -1, rover)
    while i >= 0:  # any event of the rover that no target follows
        kind = search.lists[1][outing_end(task, search, i) - 1, 0]
        if kind != EXPLORE or search.lists[1][i, 0] != EXPLORE:
            seen += 1
            if draw(search.seed, seen) == 0:
                at = i
        i = next_event(search, i, rover)
    at = outing_end(task, search, at) - 1
    event = search.lists[1][at]
    if event[0] == DOCK or event[3] < 0:
        return _set_down(task, search, rover, at, entry, count)
    return _fetch(task, search, rover, at, entry, count)


@compiled
def _set_down(task: Task, search: Search, rover: int, at: int, entry: int, count: int) -> bool:
    """Set down a rover that is aboard after event `at` for the targets held; it is picked up for what follows."""
    carrier = search.lists[1][at, 2]
    following = next_event(search, at, rover)
    down = after_carrier(task, search, carrier, at, following if following >= 0 else search.tallies[1, SIZE])
    insert(search, down, UNDOCK, rover, carrier, entry)
    _put(search, down + 1, rover, count)
    end = down + count + 1
    if following < 0 and not task.recover:
        return True
    last = search.lists[1][end - 1, 3]
    leave = entry if draw(search.seed, 2) else door(search, task.doors[EXITS, task.robots[rover, TYPE], last])
    if leave < 0:
        return False
    if following < 0 and draw(search.seed, 3) == 0:
        carrier = pick(task, search, CARRIERS)
    until = following + count + 1 if following >= 0 else search.tallies[1, SIZE]
    up = after_carrier(task, search, carrier, end - 1, until)
    insert(search, up, DOCK, rover, carrier, leave)
    return True


@compiled
def _fetch(task: Task, search: Search, rover: int, at: int, entry: int, count: int) -> bool:
    """Have a carrier bring a rover that is on the ground after event `at` to the targets held."""
    carrier = pick(task, search, CARRIERS)
    leave = door(search, task.doors[EXITS, task.robots[rover, TYPE], search.lists[1][at, 3]])
    if leave < 0:
        return False
    following = next_event(search, at, rover)
    until = following if following >= 0 else search.tallies[1, SIZE]
    up = after_carrier(task, search, carrier, at, until)
    insert(search, up, DOCK, rover, carrier, leave)
    until = until + 1 if draw(search.seed, 2) else up
    down = after_carrier(task, search, carrier, up, until)
    insert(search, down, UNDOCK, rover, carrier, entry)
    _put(search, down + 1, rover, count)
    following = next_event(search, down + count, rover)
    if following >= 0 and search.lists[1][following, 0] == DOCK:
        last = search.lists[1][down + count, 3]
        search.lists[1][following, 3] = door(search, task.doors[EXITS, task.robots[rover, TYPE], last])
        return search.lists[1][following, 3] >= 0
    return True


@compiled
def _swap(task: Task, search: Search) -> bool:
    """Let two targets change places."""
    target = _late_target(task, search)
    other = task.near[target, draw(search.seed, task.near.shape[1])]
    if other < 0 or draw(search.seed, 4) == 0:
        other = pick(task, search, TARGETS)
    if other == target:
        return False
    i, j = find(search, target), find(search, other)
    search.lists[1][i, 3], search.lists[1][j, 3] = other, target
    return True


@compiled
def _reverse(task: Task, search: Search) -> bool:
    """Turn round a part of a robot's outing."""
    events = search.lists[1]
    at = find(search, pick(task, search, TARGETS))
    end = outing_end(task, search, at)
    if end - at < 2:
        return False
    end -= draw(search.seed, end - at - 1)
    for i in range((end - at) // 2):
        one, other = events[at + i, 3], events[end - 1 - i, 3]
        events[at + i, 3], events[end - 1 - i, 3] = other, one
    return True


@compiled
def _some_ride(search: Search) -> int:
    """Return the index of a random dock or undock, -1 if none is found."""
    for _ in range(2 * TRIES):
        at = draw(search.seed, search.tallies[1, SIZE])
        if search.lists[1][at, 0] in (DOCK, UNDOCK):
            return at
    return -1


@compiled
def _remeet(task: Task, search: Search) -> bool:
    """Set down or pick up a rover at another meeting."""
    at = _some_ride(search)
    if at < 0:
        return False
    events = search.lists[1]
    rover = events[at, 1]
    kind = task.robots[rover, TYPE]
    place = events[at, 3]
    if events[at, 0] == UNDOCK and at + 1 < search.tallies[1, SIZE] and events[at + 1, 1] == rover:
        place = door(search, task.doors[ENTRIES, kind, events[at + 1, 3]])
    elif draw(search.seed, 4):
        place = door(search, task.doors[EXITS, kind, place])
    else:
        place = pick(task, search, MEETINGS)
    if place < 0 or place == events[at, 3]:
        return False
    events[at, 3] = place
    return True


@compiled
def _reorder(task: Task, search: Search) -> bool:
    """Do something a carrier has to do at another turn: a ride, with the rover's outing, or a target of its own."""
    events = search.lists[1]
    at = -1
    for _ in range(2 * TRIES):
        i = draw(search.seed, search.tallies[1, SIZE])
        if (
            events[i, 0] == DOCK
            or events[i, 0] == UNDOCK
            or (events[i, 0] == EXPLORE and task.robots[events[i, 1], AT] >= 0)
        ):
            at = i
            break
    if at < 0:
        return False
    kind, robot, place = events[at, 0], events[at, 1], events[at, 3]
    carrier = robot if kind == EXPLORE else events[at, 2]
    count = 0
    if kind == UNDOCK:
        count = min(outing_end(task, search, at) - at - 1, LONGEST_SEGMENT)
        for i in range(count):
            search.lists[TAKEN, i, 0] = events[at + 1 + i, 3]
    erase(search, at, count + 1)
    first = next_event(search, -1, carrier)
    to = after_carrier(task, search, carrier, first, search.tallies[1, SIZE])
    insert(search, to, kind, robot, -1 if kind == EXPLORE else carrier, place)
    for i in range(count):
        insert(search, to + 1 + i, EXPLORE, robot, -1, search.lists[TAKEN, i, 0])
    return True


@compiled
def _rehost(task: Task, search: Search) -> bool:
    """Have another carrier pick up a rover, and set it down again."""
    at = _some_ride(search)
    if at < 0 or search.lists[1][at, 0] != DOCK:
        return False
    carrier = pick(task, search, CARRIERS)
    if carrier == search.lists[1][at, 2]:
        return False
    search.lists[1][at, 2] = carrier
    return True


@compiled
def _exchange(task: Task, search: Search) -> bool:
    """Let two rovers change parts from some moment on."""
    if task.groups[ROVERS, 0] < 2:
        return False
    one = pick(task, search, ROVERS)
    other = pick(task, search, ROVERS)
    if one == other:
        return False
    at = outing_end(task, search, draw(search.seed, search.tallies[1, SIZE]))
    events, changed = search.lists[1], False
    for i in range(max(at, len(task.robots)), search.tallies[1, SIZE]):
        if events[i, 1] == one or events[i, 1] == other:
            events[i, 1] = other if events[i, 1] == one else one
            changed = True
    return changed


@compiled
def _rideless(task: Task, search: Search) -> bool:
    """Let a rover drive where it was carried."""
    at = _some_ride(search)
    if at < 0 or search.lists[1][at, 0] != DOCK:
        return False
    down = next_event(search, at, search.lists[1][at, 1])
    if down >= 0:
        erase(search, down, 1)
    erase(search, at, 1)
    return True


@compiled
def change(task: Task, search: Search, move: int) -> bool:
    """Make the random change of that number in the candidate."""
    if move == 0:
        return _relocate(task, search)
    if move == 1:
        return _deploy(task, search)
    if move == 2:
        return _swap(task, search)
    if move == 3:
        return _reverse(task, search)
    if move == 4:
        return _remeet(task, search)
    if move == 5:
        return _reorder(task, search)
    if move == 6:
        return _rehost(task, search)
    if move == 7:
        return _exchange(task, search)
    return _rideless(task, search)


MOVES = 9
NEEDING_TARGETS = 4
"""The moves with lower numbers are about targets."""
