"""Places the names of marks in a figure: beside their mark, clear of other marks and names, and off walls if possible.

If there is no room beside a mark, its name stands farther off at the end of a line:

::

                                  ┌──────┐
         ★ carrier1               │rover2│   ring 1 and on: also at the corners, with a line
                                  └───╲──┘
         ring 0: four sides            ★

Names are placed one by one, each at the place of least cost (`best_place`), and never moved again: marks are few, and
an optimal layout would look no better.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from marsupial.replay.palette import LIGHT

GAP_PT = 9.0  # distance from the centre of a mark to its name

CLEAR_PT = 12.0
"""Least distance of a name from the centre of another mark, so that nobody takes it for that mark's name."""

RING_PT, RINGS = 16.0, 6  # distance between rings of places, and their number

SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1))
CORNERS = tuple(product((1, -1), (1, -1)))

BLOCKED, ON_WALLS = 100.0, 3.0
"""Cost of hiding something or leaving the map, and of standing on walls alone; one ring farther off costs 1."""

Share = Callable[[Bbox], float]  # returns the share of walls, 0 to 1, below a box in the figure (pixels)


class NamedPlace(NamedTuple):
    """A place for a name: its centre relative to its mark's (points), and its ring; 0 needs no line."""

    dx: float
    dy: float
    ring: int


def name_marks(axes: Axes, marks: Mapping[str, tuple[float, float]], walls: Share) -> None:
    """Write the names of `marks` (in data coordinates) beside them; the figure must have its canvas."""
    axes.apply_aspect()  # matplotlib places axes when it draws; `transData` is wrong before that
    scale = axes.figure.dpi / 72
    spots = {name: tuple(axes.transData.transform(at)) for name, at in marks.items()}
    taken: list[Bbox] = []
    for name, at in marks.items():
        box = {"boxstyle": "round,pad=0.15", "facecolor": LIGHT.page, "edgecolor": "none", "alpha": 0.8}
        style: dict[str, Any] = {"fontsize": 8, "color": LIGHT.ink, "ha": "center", "va": "center", "bbox": box}
        text = axes.annotate(name, at, (0, 0), textcoords="offset points", zorder=6, **style)
        size = text.get_window_extent()
        clear = [Bbox([spot, spot]).padded(CLEAR_PT * scale) for other, spot in spots.items() if other != name]
        found = best_place(spots[name], (size.width, size.height), scale, [*taken, *clear], axes.bbox, walls)
        text.set_position((found.dx, found.dy))
        taken.append(_box(spots[name], (size.width, size.height), found, scale))
        if found.ring:
            line: dict[str, Any] = {"arrowstyle": "-", "color": LIGHT.ink, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 5}
            axes.annotate("", at, (found.dx, found.dy), textcoords="offset points", arrowprops=line, zorder=2.5)


def best_place(
    spot: tuple[float, ...],
    size: tuple[float, float],
    scale: float,
    taken: Sequence[Bbox],
    inside: Bbox,
    walls: Share,
) -> NamedPlace:
    """Return the place of least cost for a name of this size (pixels) whose mark is at `spot`.

    `scale`: pixels per point; `taken`: boxes that it must not hide; `inside`: the box that it must not leave.
    """

    def cost(place: NamedPlace) -> float:
        box = _box(spot, size, place, scale)
        hidden = sum(Bbox.intersection(box, other) is not None for other in taken)
        outside = not (inside.x0 <= box.x0 and box.x1 <= inside.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1)
        return BLOCKED * (hidden + outside) + place.ring + ON_WALLS * walls(box)

    return min(_places(size[0] / scale, size[1] / scale), key=cost)


def _places(width_pt: float, height_pt: float) -> Iterator[NamedPlace]:
    for ring in range(RINGS):
        away = GAP_PT + RING_PT * ring
        for u, v in SIDES if ring == 0 else (*SIDES, *CORNERS):
            yield NamedPlace(u * (away + width_pt / 2), v * (away + height_pt / 2), ring)


def _box(spot: tuple[float, ...], size: tuple[float, float], place: NamedPlace, scale: float) -> Bbox:
    x, y = spot[0] + place.dx * scale, spot[1] + place.dy * scale
    return Bbox.from_extents(x - size[0] / 2, y - size[1] / 2, x + size[0] / 2, y + size[1] / 2)
