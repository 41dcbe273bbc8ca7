"""`marsupial bench`: the project's own benchmarks."""

from __future__ import annotations

from typing import Annotated

import typer

from marsupial.errors import UsageError

BENCHES = ("paths",)


def bench(
    name: Annotated[str, typer.Argument(help="Which benchmark: paths.")],
    size: Annotated[int, typer.Option(min=64, max=8192, help="Edge of the maps in cells.")] = 1024,
    seed: Annotated[int, typer.Option(min=0, help="Draws the maps.")] = 1,
    repeats: Annotated[int, typer.Option(min=1, help="How often each job is timed; the least counts.")] = 3,
) -> None:
    """Run a benchmark beside a reference.

    paths: path costs on grids beside scipy's csgraph.

    Example: marsupial bench paths --size 512
    """
    if name not in BENCHES:
        raise UsageError(f"unknown benchmark {name!r}; there are {', '.join(BENCHES)}")
    from marsupial.bench.paths import bench_paths, table
    from marsupial.cli.tables import print_text

    print_text(table(bench_paths(size=size, seed=seed, repeats=repeats)) + "\n")
