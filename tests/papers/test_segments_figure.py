import numpy as np
from support.maps.drawn_maps import carrier

from marsupial.generators.builtin import explorers
from marsupial.model import FLOOR, Grid, Scenario
from marsupial.papers.wurm2008.figure import segments_figure


def two_rooms() -> Scenario:
    cells = np.zeros((40, 101), dtype=np.uint8)
    cells[1:39, 1:50] = cells[1:39, 51:100] = FLOOR
    cells[10:19, 50] = FLOOR
    kind = carrier(radius_m=0.15, range_m=2.0)
    return explorers("two-rooms", Grid(cells=cells, resolution_m=0.1), kind, 2)


def test_the_figure_of_a_moment_is_always_the_same_picture() -> None:
    one, other = segments_figure(two_rooms(), share=0.5), segments_figure(two_rooms(), share=0.5)
    assert (one.svg, one.png) == (other.svg, other.png)
    assert one.name == "segments-two-rooms"
    assert "50 % of the time into a mission of 2 robots" in one.caption
    assert segments_figure(two_rooms(), share=0.2).png != one.png
