import re
from pathlib import Path

import numpy as np
import pytest

from marsupial.planning.local_search.moves import MOVES, cumulative_rates

PAGE = Path(__file__).parents[3] / "docs" / "planners.md"


@pytest.mark.parametrize("busy", [False, True])
def test_each_move_is_drawn_at_its_rate(busy: bool) -> None:
    rates = [move.busy_rate if busy else move.rate for move in MOVES]
    assert np.diff(cumulative_rates(busy=busy), prepend=0).tolist() == rates
    assert min(rates) > 0


def test_the_page_on_planners_describes_every_move() -> None:
    section = PAGE.read_text().split("| move | what it changes |")[1].split("###")[0]
    assert re.findall(r"^\| ([\w -]+?) \| ", section, flags=re.M) == [move.name for move in MOVES]
