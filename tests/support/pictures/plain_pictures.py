"""One picture of each kind that we draw, in this process or as `python plain_pictures.py FOLDER`."""

import io
import sys
from pathlib import Path

from support.missions.synthetic_mission import synthetic_mission

from marsupial.bench.compare.figures import as_figure, legend, panels
from marsupial.exports.style import plain_style
from marsupial.exports.write import ExportOptions, export_mission
from marsupial.generators.builtin import builtin_scenario
from marsupial.library.exploring import Exploration


class OnlyEvents(Exploration):
    """A result without metrics."""

    def __init__(self) -> None:
        object.__setattr__(self, "events", synthetic_mission())


def pictures() -> dict[str, bytes]:
    """Return the pictures by name."""
    out = io.BytesIO()
    OnlyEvents().plot().savefig(out, format="png")
    found = {"plot.png": out.getvalue()}
    found["mission.svg"] = export_mission(synthetic_mission(), ".svg", ExportOptions())
    with plain_style():
        from marsupial.exports.mapfigure import map_figure

        grid = builtin_scenario("lobby", 1, 0).grid
        found["map.svg"] = map_figure(grid, grid.cells, "lobby", {}, kind="svg")
        drawing, ((axes,),) = panels(1, 1, height=2)
        axes.plot([1, -2, 3], label="one")
        legend(drawing, [[axes]])
        found["panels.svg"] = as_figure(drawing, "a", "b", "c").svg.encode()
    return found


if __name__ == "__main__":
    for name, data in pictures().items():
        (Path(sys.argv[1]) / name).write_bytes(data)
    import matplotlib

    print(matplotlib.rcParams["font.size"], matplotlib.rcParams["text.usetex"])
