"""Random choices of nodes and positions, about half of them guided; compiled.

Uniform choices alone waste most moves of a large schedule on events that no other event waits for. So a node is chosen
half of the time from a critical path: the chain of events, each waiting for the one before it, that ends with something
late. The other half is uniform, as the necessary change may lie elsewhere.
"""

from marsupial.native import inlined
from marsupial.planning.local_search import columns as col
from marsupial.planning.local_search import linked_schedule as ops
from marsupial.planning.local_search.linked_schedule import LinkedSchedule

TRIES = 8  # how often to redraw where a draw may be useless

LONG = 1 << 60

FOCUS = 4  # the latest of up to this number of random targets is chosen
WATCHED = 8  # the robot with the latest end of up to this number of random ones is chosen


@inlined
def critical_node(sched: LinkedSchedule) -> int:
    """Return a random node on the critical path to something late, -1 if nothing is done."""
    node = _random_end(sched)
    for _ in range(ops.draw(sched, WATCHED)):
        other = _random_end(sched)
        if sched.nodes[other, col.KIND] != col.START and sched.nodes[other, col.END] > sched.nodes[node, col.END]:
            node = other
    # Reservoir sampling: uniform over the path, without storing it.
    chosen, seen = -1, 0
    while sched.nodes[node, col.KIND] != col.START:
        seen += 1
        if ops.draw(sched, seen) == 0:
            chosen = node
        node = critical_predecessor(sched, node)
    return chosen


@inlined
def _random_end(sched: LinkedSchedule) -> int:
    """Return the last node of a random carrier's route or of a random sortie."""
    node = ops.draw(sched, len(sched.robots))
    if sched.nodes[node, col.BEFORE] < 0:
        if not sched.groups[col.TARGETS, 0]:
            return sched.nodes[ops.pick(sched, col.CARRIERS), col.BEFORE]
        node = random_target(sched)
        if ops.is_carrier(sched, sched.nodes[node, col.ROBOT]):
            return node
        node = ops.head_of(sched, node)
    return sched.nodes[node, col.BEFORE]


@inlined
def critical_predecessor(sched: LinkedSchedule, node: int) -> int:
    """Return which of the nodes before one determines when it begins."""
    nodes = sched.nodes
    kind, previous = nodes[node, col.KIND], nodes[node, col.BEFORE]
    if kind == col.EXPLORE:
        return previous
    other = nodes[node, col.CARRIER_BEFORE]
    if kind == col.UNDOCK:
        return other
    place = nodes[node, col.PLACE]
    ready = nodes[previous, col.END] + ops.leg_ms(sched, nodes[node, col.ROBOT], nodes[previous, col.PLACE], place)
    there = nodes[other, col.END] + ops.leg_ms(sched, nodes[node, col.CARRIER], nodes[other, col.PLACE], place)
    return other if there >= ready else previous


@inlined
def random_target(sched: LinkedSchedule) -> int:
    """Return a random target's node."""
    return len(sched.robots) + ops.draw(sched, sched.groups[col.TARGETS, 0])


@inlined
def late_target(sched: LinkedSchedule) -> int:
    """Return a random target's node, more often one reached late or on a critical path."""
    if ops.draw(sched, 2):
        node = critical_node(sched)
        if node >= 0 and sched.nodes[node, col.KIND] == col.UNDOCK:
            node = sched.nodes[node, col.AFTER]
        elif node >= 0 and sched.nodes[node, col.KIND] == col.DOCK:
            node = sched.nodes[node, col.BEFORE]
        if node >= 0 and sched.nodes[node, col.KIND] == col.EXPLORE:
            return node
    one = random_target(sched)
    for _ in range(ops.draw(sched, FOCUS)):
        other = random_target(sched)
        if sched.nodes[other, col.END] > sched.nodes[one, col.END]:
            one = other
    return one


@inlined
def near_target(sched: LinkedSchedule, target: int) -> int:
    """Return the node of a target near another one, or sometimes of any."""
    other = sched.hints[sched.nodes[target, col.PLACE], col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
    if other < 0 or ops.draw(sched, 4) == 0:
        other = random_target(sched)
    return other


@inlined
def _first_transfer(sched: LinkedSchedule) -> int:
    return len(sched.robots) + sched.groups[col.TARGETS, 0]


@inlined
def _in_use(sched: LinkedSchedule, node: int) -> bool:
    return node < len(sched.nodes) and sched.nodes[node, col.KIND] != col.FREE and sched.nodes[node, col.BEFORE] >= 0


@inlined
def random_node(sched: LinkedSchedule) -> int:
    """Return a random node that is in use."""
    top = _first_transfer(sched)
    transfers = len(sched.nodes) - top - sched.work[0, col.UNUSED]
    while True:
        node = ops.draw(sched, top + 2 * transfers)
        if _in_use(sched, node):
            return node


@inlined
def random_transfer(sched: LinkedSchedule, kind: int) -> int:
    """Return a random dock or undock (or any for `START`), -1 if none is found."""
    if ops.draw(sched, 2):
        node = critical_node(sched)
        if node >= 0 and sched.nodes[node, col.KIND] != col.EXPLORE:
            if kind in (col.START, sched.nodes[node, col.KIND]):
                return node
            node = sched.nodes[node, col.CARRIER_BEFORE]
            if kind == sched.nodes[node, col.KIND]:
                return node
    top = _first_transfer(sched)
    transfers = len(sched.nodes) - top - sched.work[0, col.UNUSED]
    if not transfers:
        return -1
    # Rows in use are mostly the first ones, so rows from twice their number are drawn.
    for _ in range(2 * TRIES):
        node = top + ops.draw(sched, 2 * transfers)
        if _in_use(sched, node) and kind in (col.START, sched.nodes[node, col.KIND]):
            return node
    return -1


@inlined
def consider(sched: LinkedSchedule, carrier: int, node: int, place: int, guided: bool, rank: int) -> tuple[bool, int]:
    """Consider a position behind a node for a stop of a carrier; return whether it is the choice so far, and the rank.

    Guided, the least detour is chosen and is the rank, `LONG` at first. Otherwise the choice is uniform by reservoir
    sampling, and the rank is the number of positions considered.
    """
    if not guided:
        return ops.draw(sched, rank + 1) == 0, rank + 1
    longer = detour(sched, carrier, node, place)
    return longer < rank, min(longer, rank)


@inlined
def detour(sched: LinkedSchedule, carrier: int, node: int, place: int) -> int:
    """Return the detour of a carrier that stops at a place behind a node."""
    here, following = sched.nodes[node, col.PLACE], ops.after(sched, node, carrier)
    longer = ops.leg_ms(sched, carrier, here, place)
    if following != carrier:
        there = sched.nodes[following, col.PLACE]
        longer += ops.leg_ms(sched, carrier, place, there) - ops.leg_ms(sched, carrier, here, there)
    return longer


@inlined
def transfer_position(sched: LinkedSchedule, transfer: int, carrier: int, first: int) -> int:
    """Return a node of a carrier's route, from `first` on, to insert a transfer behind that is in no route, or -1.

    The choice is random or of the least detour, among positions that fit by the load and the times before the change: a
    rover is not set down after its sortie was to end, nor picked up before it could be there.
    """
    last, docks = sched.nodes[transfer, col.BEFORE], sched.nodes[transfer, col.KIND] == col.DOCK
    if ops.seats_matter(sched) and not ops.seats(sched, carrier, sched.nodes[transfer, col.ROBOT]):
        return -1
    earliest, latest = 0, LONG
    # `first` may be the undock of its sortie, just inserted: the end of the sortie moves by as much as the undock.
    if docks:
        earliest = sched.nodes[last, col.END]
        if first != carrier:
            earliest += sched.nodes[sched.nodes[first, col.CARRIER_BEFORE], col.END] - sched.nodes[first, col.END]
    elif sched.nodes[transfer, col.COUNTED]:
        latest = sched.nodes[last, col.END]
    chosen, node, reached = -1, carrier, False
    load, places = ops.initial_load(sched, carrier), sched.robots[carrier, col.CAPACITY]
    guided = ops.draw(sched, 2) == 0
    rank = LONG if guided else 0
    while True:
        load += ops.load_change(sched, node)
        reached = reached or node == first
        behind = ops.after(sched, node, carrier)
        if reached and (load < places if docks else load > 0):
            if sched.nodes[node, col.END] > latest:
                return chosen
            if behind == carrier or sched.nodes[behind, col.END] >= earliest:
                better, rank = consider(sched, carrier, node, sched.nodes[transfer, col.PLACE], guided, rank)
                if better:
                    chosen = node
        if behind == carrier:
            return chosen
        node = behind


@inlined
def other_position(sched: LinkedSchedule, carrier: int, but: int, place: int) -> int:
    """Return a node of a carrier's route other than `but`, random or of the least detour for a stop behind it."""
    chosen, node = carrier, carrier
    guided = ops.draw(sched, 2) == 0
    rank = LONG if guided else 0
    while True:
        if node != but:
            better, rank = consider(sched, carrier, node, place, guided, rank)
            if better:
                chosen = node
        node = ops.after(sched, node, carrier)
        if node == carrier:
            return chosen


@inlined
def near_carrier(sched: LinkedSchedule, target: int) -> int:
    """Return a random carrier, more often one with stops near a target, and one that ends early."""
    nodes = sched.nodes
    # A tournament of two balances the load between carriers.
    one, other = _near_carrier(sched, target), _near_carrier(sched, target)
    if ops.draw(sched, 4) and nodes[nodes[other, col.BEFORE], col.END] < nodes[nodes[one, col.BEFORE], col.END]:
        return other
    return one


@inlined
def other_carrier(sched: LinkedSchedule, node: int) -> int:
    """Return a random carrier to take over a transfer, more often one with stops near the target beside it."""
    nodes = sched.nodes
    target = nodes[node, col.BEFORE if nodes[node, col.KIND] == col.DOCK else col.AFTER]
    return near_carrier(sched, target) if nodes[target, col.KIND] == col.EXPLORE else ops.pick(sched, col.CARRIERS)


@inlined
def _near_carrier(sched: LinkedSchedule, target: int) -> int:
    if ops.draw(sched, 8):
        node = sched.hints[sched.nodes[target, col.PLACE], col.NEAR + ops.draw(sched, col.NEIGHBOURS)]
        if node >= 0 and sched.nodes[node, col.BEFORE] >= 0:
            if ops.is_carrier(sched, sched.nodes[node, col.ROBOT]):
                return sched.nodes[node, col.ROBOT]
            transfer = ops.head_of(sched, node)
            if ops.draw(sched, 2):
                transfer = sched.nodes[transfer, col.BEFORE]
            if ops.is_transfer(sched, transfer):
                return sched.nodes[transfer, col.CARRIER]
    return ops.pick(sched, col.CARRIERS)
