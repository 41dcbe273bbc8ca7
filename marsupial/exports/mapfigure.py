"""How a map is interpreted, as a figure: who can stand where, unknown ground, leaks, islands, starts.

Names of starts stand beside their mark, clear of other marks and names. If there is no room beside a mark, its name
stands farther off at the end of a line:

::

                                  ┌──────┐
         ★ carrier1               │rover2│   ring 1 and on: also at the corners, with a line
                                  └───╲──┘
         ring 0: four sides            ★

Axes count metres of the map frame, so that a point read off them can stand in a scenario file. If the map is rotated in
its frame, the frame's metres do not run along the map's edges: then axes count from the map's corner, and say so.

Names are placed one by one, each at the place of least cost (`best_place`), and never moved again: marks are few, and
an optimal layout would look no better.
"""

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from marsupial.errors import UsageError
from marsupial.exports.figures import figure_file
from marsupial.exports.ground import coarse
from marsupial.exports.mapclasses import LOOKS, MapClass
from marsupial.model.grid import Cell, CellArray, Grid
from marsupial.replay.palette import LIGHT

WIDTH_IN, LEGEND_IN, DPI = 10.0, 3.3, 150.0
WARNING_WIDTH = 118  # characters of a warning that fit the width
TICKS_IN = 0.65  # width left of the map for the labels of ticks

# Most pixels of the map's longer side: more would be finer than the figure, and make an SVG of megabytes.
MOST_PIXELS = 1400

ROTATED_RAD = 1e-6  # a smaller yaw is a rounding error: it moves no corner of a map of kilometres by a centimetre

GAP_PT = 9.0  # distance from the centre of a mark to its name

# Least distance of a name from the centre of another mark, so that it is not taken for that mark's name.
CLEAR_PT = 12.0

RING_PT, RINGS = 16.0, 6  # distance between rings of places, and their number

SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1))
CORNERS = tuple(product((1, -1), (1, -1)))

BLOCKED = 100.0  # cost of hiding something or leaving the map; one ring farther off costs 1

KINDS = ("png", "svg", "pdf")


def map_figure(
    grid: Grid,
    classes: CellArray,
    title: str,
    starts: Mapping[str, Cell],
    *,
    kind: str,
    start_text: str = "start",
    warnings: Sequence[str] = (),
) -> bytes:
    """Return the figure of `MapClass` codes (height, width) and start cells as a file of one of `KINDS`.

    `start_text` labels starts in the legend; `warnings`, what looks wrong about the map, are written below it.
    """
    if kind not in KINDS:
        raise UsageError(f"can't write .{kind}; there are {', '.join('.' + name for name in KINDS)}")
    wide_in = WIDTH_IN - LEGEND_IN - TICKS_IN + 0.2
    high_in = min(12.0, max(3.2, wide_in * grid.height / grid.width))
    wrapper = textwrap.TextWrapper(WARNING_WIDTH, subsequent_indent="  ", break_long_words=False)
    warned = [line for text in warnings for line in wrapper.wrap(f"! {text}")]
    below_in = 0.25 * len(warned)
    whole_in = high_in + 0.9 + below_in
    figure = Figure(figsize=(WIDTH_IN, whole_in), dpi=DPI, facecolor=LIGHT.page)
    FigureCanvasAgg(figure)
    place = (TICKS_IN / WIDTH_IN, (below_in + 0.4) / whole_in, wide_in / WIDTH_IN, high_in / whole_in)
    axes = figure.add_axes(place)
    is_rotated = abs(grid.origin_m[2]) > ROTATED_RAD
    origin_m = (0.0, 0.0, 0.0) if is_rotated else (*grid.origin_m[:2], 0.0)
    on_axes = replace(grid, origin_m=origin_m)
    _draw_map(axes, on_axes, classes)
    if is_rotated:
        turn = f"the map is turned by {math.degrees(grid.origin_m[2]):.3g}° in the map frame"
        axes.set_xlabel(f"metres from the lower left corner: {turn}", fontsize=8, color=LIGHT.dim)
    _draw_starts(axes, on_axes, starts)
    figure.text(0.2 / WIDTH_IN, 1 - 0.14 / whole_in, title, fontsize=13, fontweight="bold", color=LIGHT.ink, va="top")
    _add_legend(figure, grid, classes, start_text if starts else "", top=1 - 0.5 / whole_in)
    for row, line in enumerate(warned):
        y = (below_in - 0.25 * row) / whole_in
        figure.text(0.2 / WIDTH_IN, y, line, fontsize=9, color=LOOKS[MapClass.LEAK].colour, va="top")
    return figure_file(figure, kind)


def _draw_map(axes: Axes, on_axes: Grid, classes: CellArray) -> None:
    block = max(1, math.ceil(max(classes.shape) / MOST_PIXELS))
    picture = coarse(classes, block)
    image = np.zeros((*picture.shape, 3), dtype=np.uint8)
    for kind in MapClass:
        image[picture == kind] = tuple(bytes.fromhex(LOOKS[kind].colour[1:]))
    height, width = (block * size for size in picture.shape)
    left, bottom = on_axes.point_m(0, 0)
    right, top = on_axes.point_m(width, height)
    axes.imshow(image, origin="lower", extent=(left, right, bottom, top), interpolation="nearest")
    right, top = on_axes.point_m(on_axes.width, on_axes.height)  # the last blocks may reach beyond
    axes.axis((left, right, bottom, top))
    axes.set_anchor("NW")
    axes.tick_params(labelsize=8, colors=LIGHT.dim, length=2)
    axes.yaxis.set_major_locator(MaxNLocator(6))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: f"{round(value, 6) + 0.0:.10g} m")
    axes.spines[:].set_color(LIGHT.dim)


def _draw_starts(axes: Axes, on_axes: Grid, starts: Mapping[str, Cell]) -> None:
    marks = {name: on_axes.centre_m(cell) for name, cell in starts.items()}
    for x, y in marks.values():
        axes.plot(x, y, "*", markersize=13, color=LIGHT.frontier, markeredgecolor=LIGHT.ink, markeredgewidth=1.0)
    name_marks(axes, marks)


def _add_legend(figure: Figure, grid: Grid, classes: CellArray, start_text: str, *, top: float) -> None:
    """Add a legend of the classes that occur, with their areas, and of starts if they have a text."""
    counts = np.bincount(classes.ravel(), minlength=256)
    handles: list[Any] = []
    for kind, look in LOOKS.items():
        if counts[kind]:
            label = f"{look.text}\n{counts[kind] * grid.cell_area_m2:,.1f} m²"
            handles.append(Patch(facecolor=look.colour, edgecolor=LIGHT.dim, label=label))
    if start_text:
        star: dict[str, Any] = {"marker": "*", "markersize": 12, "markeredgecolor": LIGHT.ink}
        handles.append(Line2D([], [], linestyle="", color=LIGHT.frontier, label=start_text, **star))
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1 - (LEGEND_IN - 0.45) / WIDTH_IN, top), fontsize=9,
        frameon=False, labelcolor=LIGHT.ink, handlelength=1.3, handleheight=1.3, labelspacing=0.8,
    )  # fmt: skip


class NamedPlace(NamedTuple):
    """A place for a name: its box (pixels), and its ring; 0 needs no line."""

    box: Bbox
    ring: int


def name_marks(axes: Axes, marks: Mapping[str, tuple[float, float]]) -> None:
    """Write the names of `marks` (in data coordinates) beside them; the figure must have its canvas."""
    axes.apply_aspect()  # matplotlib places axes when it draws; `transData` is wrong before that
    scale = axes.figure.dpi / 72
    spots = {name: tuple(axes.transData.transform(at)) for name, at in marks.items()}
    taken: list[Bbox] = []
    for name, at in marks.items():
        box = {"boxstyle": "round,pad=0.15", "facecolor": LIGHT.page, "edgecolor": "none", "alpha": 0.8}
        style: dict[str, Any] = {"fontsize": 8, "color": LIGHT.ink, "ha": "center", "va": "center", "bbox": box}
        text = axes.annotate(name, at, (0, 0), textcoords="offset points", zorder=6, **style)
        clear = [Bbox([spot, spot]).padded(CLEAR_PT * scale) for other, spot in spots.items() if other != name]
        places = places_beside(spots[name], text.get_window_extent().size, scale)
        found = best_place(places, [*taken, *clear], axes.bbox)
        taken.append(found.box)
        offset = tuple((found.box.get_points().mean(axis=0) - spots[name]) / scale)
        text.set_position(offset)
        if found.ring:
            line: dict[str, Any] = {"arrowstyle": "-", "color": LIGHT.ink, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 5}
            axes.annotate("", at, offset, textcoords="offset points", arrowprops=line, zorder=2.5)


def places_beside(spot: Sequence[float], size: Sequence[float], scale: float) -> Iterator[NamedPlace]:
    """Yield the places for a name of this size whose mark is at `spot`, in pixels, `scale` of them to a point."""
    for ring in range(RINGS):
        away = scale * (GAP_PT + RING_PT * ring)
        for sides in SIDES if ring == 0 else (*SIDES, *CORNERS):
            corner = [
                at + side * (away + length / 2) - length / 2 for at, side, length in zip(spot, sides, size, strict=True)
            ]
            yield NamedPlace(Bbox.from_bounds(*corner, *size), ring)


def best_place(places: Iterable[NamedPlace], taken: Sequence[Bbox], inside: Bbox) -> NamedPlace:
    """Return the place of least cost: it hides none of the boxes `taken`, and does not leave `inside`."""

    def cost(place: NamedPlace) -> float:
        box = place.box
        hidden = sum(Bbox.intersection(box, other) is not None for other in taken)
        outside = not (inside.x0 <= box.x0 and box.x1 <= inside.x1 and inside.y0 <= box.y0 and box.y1 <= inside.y1)
        return BLOCKED * (hidden + outside) + place.ring

    return min(places, key=cost)
