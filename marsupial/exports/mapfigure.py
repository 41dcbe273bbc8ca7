"""How a map is interpreted, as a figure: who can stand where, unknown ground, leaks, islands, starts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox

from marsupial.errors import UsageError
from marsupial.exports.figures import MapAxes, figure_file
from marsupial.exports.ground import coarse
from marsupial.exports.mapclasses import COLOURS, TEXTS, MapClass
from marsupial.exports.marknames import name_marks
from marsupial.model.grid import Cell, CellArray, Grid
from marsupial.replay.palette import LIGHT

WIDTH_IN, LEGEND_IN, DPI = 10.0, 3.3, 150.0
TICKS_IN = 0.65  # width left of the map for the labels of ticks

MOST_PIXELS = 1400
"""Most pixels of the map's longer side: more would be finer than the figure, and make an SVG of megabytes."""

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
    below_in = 0.25 * sum(len(wrapped(text)) for text in warnings)
    whole_in = high_in + 0.9 + below_in
    figure = Figure(figsize=(WIDTH_IN, whole_in), dpi=DPI, facecolor=LIGHT.page)
    FigureCanvasAgg(figure)
    place = (TICKS_IN / WIDTH_IN, (below_in + 0.4) / whole_in, wide_in / WIDTH_IN, high_in / whole_in)
    axes = figure.add_axes(place)
    frame = MapAxes(grid.width, grid.height, grid.resolution_m, grid.origin_m)
    _draw_map(axes, frame, classes)
    _draw_starts(axes, frame, classes, starts)
    figure.text(0.2 / WIDTH_IN, 1 - 0.14 / whole_in, title, fontsize=13, fontweight="bold", color=LIGHT.ink, va="top")
    _add_legend(figure, grid, classes, start_text if starts else "", top=1 - 0.5 / whole_in)
    for row, line in enumerate(line for text in warnings for line in wrapped(text)):
        y = (below_in - 0.25 * row) / whole_in
        figure.text(0.2 / WIDTH_IN, y, line, fontsize=9, color=COLOURS[MapClass.LEAK], va="top")
    return figure_file(figure, kind)


def wrapped(text: str) -> list[str]:
    """Return the lines of a warning."""
    lines = [""]
    for word in f"! {text}".split():
        if len(lines[-1]) + len(word) > 118:  # as many fit the figure
            lines.append("  ")
        lines[-1] += f"{word} "
    return lines


def _draw_map(axes: Axes, frame: MapAxes, classes: CellArray) -> None:
    block = max(1, math.ceil(max(classes.shape) / MOST_PIXELS))
    picture = coarse(classes, block)
    image = np.zeros((*picture.shape, 3), dtype=np.uint8)
    for kind in MapClass:
        image[picture == kind] = tuple(bytes.fromhex(COLOURS[kind][1:]))
    height, width = (block * size for size in picture.shape)
    axes.imshow(image, origin="lower", extent=frame.part(width, height), interpolation="nearest")
    axes.axis(frame.extent)
    axes.set_anchor("NW")
    axes.tick_params(labelsize=8, colors=LIGHT.dim, length=2)
    axes.yaxis.set_major_locator(MaxNLocator(6))
    frame.label(axes)
    axes.xaxis.label.set_color(LIGHT.dim)
    axes.spines[:].set_color(LIGHT.dim)


def _draw_starts(axes: Axes, frame: MapAxes, classes: CellArray, starts: Mapping[str, Cell]) -> None:
    marks = {name: frame.centre(cell) for name, cell in starts.items()}
    for x, y in marks.values():
        axes.plot(x, y, "*", markersize=13, color=LIGHT.frontier, markeredgecolor=LIGHT.ink, markeredgewidth=1.0)
    name_marks(axes, marks, lambda box: _walled(axes, classes, box))


def _walled(axes: Axes, classes: CellArray, box: Bbox) -> float:
    """Return the share of walls, 0 to 1, below a box in the figure (pixels)."""
    height, width = classes.shape
    low, high = axes.transAxes.inverted().transform(box.get_points()) * (width, height)
    left, bottom = np.maximum(low, 0).astype(int)
    under = classes[bottom : max(0, math.ceil(high[1])), left : max(0, math.ceil(high[0]))]
    return float(np.mean(under == MapClass.WALL)) if under.size else 0.0


def _add_legend(figure: Figure, grid: Grid, classes: CellArray, start_text: str, *, top: float) -> None:
    """Add a legend of the classes that occur, with their areas, and of starts if they have a text."""
    counts = np.bincount(classes.ravel(), minlength=256)
    handles: list[Any] = []
    for kind, text in TEXTS.items():
        if counts[kind]:
            label = f"{text}\n{counts[kind] * grid.cell_area_m2:,.1f} m²"
            handles.append(Patch(facecolor=COLOURS[kind], edgecolor=LIGHT.dim, label=label))
    if start_text:
        star: dict[str, Any] = {"marker": "*", "markersize": 12, "markeredgecolor": LIGHT.ink}
        handles.append(Line2D([], [], linestyle="", color=LIGHT.frontier, label=start_text, **star))
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1 - (LEGEND_IN - 0.45) / WIDTH_IN, top), fontsize=9,
        frameon=False, labelcolor=LIGHT.ink, handlelength=1.3, handleheight=1.3, labelspacing=0.8,
    )  # fmt: skip
