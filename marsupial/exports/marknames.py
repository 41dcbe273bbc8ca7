"""The names of marks in a figure, each beside its own: clear of other marks and names, and of walls if it can be.

Where there is no room beside a mark its name stands farther off, at the end of a line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from marsupial.replay.palette import LIGHT

GAP_PT = 9.0
"""From the centre of a mark to the name beside it."""

CLEAR_PT = 12.0
"""How far names keep from the centre of another mark, so that nobody takes them for its name."""

RING_PT, RINGS = 16.0, 6
"""Names with a line are so much farther off, once for each ring."""

SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1))
CORNERS = tuple(product((1, -1), (1, -1)))

BLOCKED, ON_WALLS = 100.0, 3.0
"""What it costs to hide something or to leave the map, and to stand on nothing but walls, in rings farther off."""

Share = Callable[[Bbox], float]
"""How much of a box in the figure (pixels) is walls, 0 to 1."""


@dataclass(frozen=True, slots=True)
class NamedPlace:
    """Where a name may stand: its centre from that of its mark (points), and whether a line leads there."""

    dx: float
    dy: float
    ring: int


def name_marks(axes: Axes, marks: Mapping[str, tuple[float, float]], walls: Share) -> None:
    """Write the names of `marks` (in the data of the axes) beside them; the figure must have its canvas."""
    axes.apply_aspect()
    scale = axes.figure.dpi / 72
    spots = {name: tuple(axes.transData.transform(at)) for name, at in marks.items()}
    taken: list[Bbox] = []
    for name, at in marks.items():
        box = {"boxstyle": "round,pad=0.15", "facecolor": LIGHT.page, "edgecolor": "none", "alpha": 0.8}
        look: dict[str, Any] = {"fontsize": 8, "color": LIGHT.ink, "ha": "center", "va": "center", "bbox": box}
        text = axes.annotate(name, at, (0, 0), textcoords="offset points", zorder=6, **look)
        size = text.get_window_extent()
        clear = [_around(spot, CLEAR_PT * scale) for other, spot in spots.items() if other != name]
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
    """Return where a name of that size (pixels) stands best beside its mark at `spot`.

    Parameters
    ----------
    scale
        Pixels in a point.
    taken, inside
        What it must not hide, and what it must not leave.
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


def _around(spot: tuple[float, ...], far: float) -> Bbox:
    return Bbox.from_extents(spot[0] - far, spot[1] - far, spot[0] + far, spot[1] + far)
