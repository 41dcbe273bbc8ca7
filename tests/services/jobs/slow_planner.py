"""An external planner for `situations.one_room`: two plans, the second one better, then it waits to be terminated.

Between the two it waits for the file named by its last argument.
"""

import sys
import time
from pathlib import Path

DETOUR = (
    "0.000: (move c1 carrier c1_start m1) [10.000]\n"
    "10.001: (move c1 carrier m1 home) [10.000]\n"
    "20.002: (move c1 carrier home m1) [10.000]\n"
    "30.003: (undock r1 c1 m1) [5.000]\n"
    "35.004: (explore r1 rover m1 t1) [4.000]\n"
)
STRAIGHT = (
    "0.000: (move c1 carrier c1_start m1) [10.000]\n"
    "10.001: (undock r1 c1 m1) [5.000]\n"
    "15.002: (explore r1 rover m1 t1) [4.000]\n"
)


def main() -> None:
    print(DETOUR, flush=True)
    while not Path(sys.argv[-1]).exists():
        time.sleep(0.01)
    print(STRAIGHT, flush=True)
    time.sleep(3600)


main()
