"""Every problem of the MovingAI benchmark files: their lengths hold only without corner cutting."""

from pathlib import Path

import numpy as np
import pytest

from marsupial.model.grid import Cell, Mask
from marsupial.paths.fields import PathSearch
from marsupial.paths.routes import route_length


def read_map(file: Path) -> Mask:
    lines = file.read_text().splitlines()
    rows = lines[lines.index("map") + 1 :]
    return np.array([[char in ".G" for char in row] for row in reversed(rows) if row], dtype=np.bool_)


def problems_of(file: Path) -> list[tuple[str, Cell, Cell, float]]:
    """Return map name, start, goal and optimal length of each line; rows of the file count from the top."""
    problems = []
    for line in filter(str.strip, file.read_text().splitlines()[1:]):
        _, name, _, height, *numbers = line.split()
        x0, y0, x1, y1 = map(int, numbers[:4])
        top = int(height) - 1
        problems.append((Path(name).name, Cell(x0, top - y0), Cell(x1, top - y1), float(numbers[4])))
    return problems


@pytest.fixture(scope="module")
def problems(shared_maps: Path) -> list[tuple[PathSearch, Cell, Cell, float]]:
    folder = shared_maps / "movingai"
    read = [problem for file in sorted(folder.glob("*.scen")) for problem in problems_of(file)]
    searches = {name: PathSearch(read_map(folder / name)) for name in {name for name, *_ in read}}
    return [(searches[name], start, goal, length) for name, start, goal, length in read]


def test_every_optimal_length_is_reproduced(problems: list[tuple[PathSearch, Cell, Cell, float]]):
    assert problems
    wrong = [
        (start, goal, length, float(found))
        for search, start, goal, length in problems
        for found in search.lengths(start, [goal])
        if not abs(found - length) <= 0.001
    ]
    assert wrong == []


def test_every_route_has_the_optimal_length(problems: list[tuple[PathSearch, Cell, Cell, float]]):
    for search, start, goal, length in problems:
        route = search.route(start, goal)
        assert route is not None
        assert route_length(route) == pytest.approx(length, abs=0.001)
