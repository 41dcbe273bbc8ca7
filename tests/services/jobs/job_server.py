"""A server process to be killed: it submits jobs one by one and prints the id of each acknowledged one.

Arguments: the folder, what to submit (`many`: small ones as fast as they are taken; `slow`: one of `slow_planner.py`,
which waits for a file `go` in the folder), and the folders to import from.
"""

import asyncio
import os
import sys
from pathlib import Path


async def serve(folder: Path, what: str) -> None:
    from job_setup import SLOW, open_jobs, planned, request, submit
    from support.planning.situations import many_rooms, one_hall

    from benchmarks.trial import failpoints
    from marsupial_service.entries.records import TooMany

    failpoints.arm(os.environ[failpoints.VARIABLE])

    async with open_jobs(folder, slots=2, queue=8, commands={"slow": f"{SLOW} {folder / 'go'}"}) as jobs:
        if what == "slow":
            job = await submit(jobs, request(planner="slow"))
            await planned(jobs, job)
            print(job, flush=True)
            await asyncio.sleep(3600)
        for number in range(10**6):
            longer = request(many_rooms(2, 1, 6, 3), "anytime", seconds=None, steps=150)
            wanted = request(one_hall()) if number % 2 else longer
            try:
                print(await submit(jobs, wanted), flush=True)
            except TooMany:
                await asyncio.sleep(0.05)


if __name__ == "__main__":
    sys.path[:] = sys.argv[3:]
    asyncio.run(serve(Path(sys.argv[1]), sys.argv[2]))
