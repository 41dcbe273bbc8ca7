"""The columns of the arrays of local search, and the numbers of what stands in them."""

EXPLORE, UNDOCK, DOCK, START = 0, 1, 2, 3
"""Kinds of event, the first column; the others are the robot, the carrier (-1 if none) and the place."""

NEIGHBOURS = 10  # near targets stored per target
NEAR_MEETINGS = 6  # near meetings stored per place, type and direction

TYPE, AT, ABOARD, READY, CAPACITY, DOCKING, UNDOCKING, HOME = range(8)
"""Columns of robots: -1 for no place or carrier; docking and undocking end with being ready again."""

TARGETS, MEETINGS, ROVERS, CARRIERS = range(4)  # groups
ENTRIES, EXITS = 0, 1  # directions of near meetings: from a meeting to the place, from the place to a meeting


FREE = 4  # kind of a transfer that is not in use

KIND, ROBOT, CARRIER, PLACE, BEFORE, AFTER, CARRIER_BEFORE, CARRIER_AFTER, END, DRIVE, STAMP, COUNTED = range(12)
WIDTH = 12
"""Columns of nodes. `END` is from when the robots are ready again, `DRIVE` the driving it takes, `COUNTED` whether the
sums contain it; a start's `CARRIER_BEFORE` holds when its robot is home, 0 where it has no home to go to. `ROBOT` of
a rover's node is the first rover of its type. `BEFORE` is -1 out of all chains."""

LOAD = 8  # column of robots: rovers of the first type aboard at first; those of the other types, and `seats`, follow

EPOCH, LOGGED, QUEUED, CHECKS, DROPPED, DUE, SOONER, REACHING, DRIVING, LATE, UNUSED, FORMER_SUMS = range(12)
UNDONE = FORMER_SUMS - REACHING
SUMS = FORMER_SUMS + UNDONE
"""Columns of the first row of `work`: number of the change, lengths of the other rows, due date, the number
of queued nodes that may end sooner, sums over the nodes and the number of free transfers, and the last `UNDONE` as they
were before the change."""

QUEUE, FORMER, CHECK, SPARE, DROP, TAKEN, QUEUED_IN = range(1, 8)
ROWS = 8
"""Other rows of `work`: queue of nodes to be timed, their former ends, carriers whose load is to be checked, free
transfers, transfers that become free once the change is accepted, nodes taken by a move; and per node, twice the number
of the change that queued it, plus one if it may end sooner, 0 out of the queue."""

NODE, WORTH, NEAR = 0, 1, 2
"""Columns of `hints`; after the nodes of the nearest targets come near meetings: entries and exits per type."""

FAR = (1 << 31) - 1  # a leg without a path; the largest 32-bit integer, as legs are stored in 32 bits
