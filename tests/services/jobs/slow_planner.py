"""An external planner for `situations.one_room`: two plans, the second one better, then it waits till it is ended.

Between the two it waits for the file named by its last argument.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

PLAN = (
    "{0}: (move c1 carrier c1_start m1) [10.000]\n"
    "{1}: (undock r1 c1 m1) [5.000]\n"
    "{2}: (explore r1 rover m1 t1) [4.000]\n"
)


def main() -> None:
    print(PLAN.format("5.000", "20.000", "30.000"), flush=True)
    print("Plan found\n", flush=True)
    while not Path(sys.argv[-1]).exists():
        time.sleep(0.01)
    print(PLAN.format("0.000", "10.001", "15.002"), flush=True)
    time.sleep(600)


main()
