"""Pictures don't depend on the settings of matplotlib, and don't change them."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure
from support.missions.synthetic_mission import synthetic_mission
from support.pictures import plain_pictures

from marsupial.exports.drawing import mission_figure
from marsupial.exports.figures import figure_file
from marsupial.exports.style import plain_style

ODD = """text.usetex: True
figure.constrained_layout.use: True
figure.autolayout: True
font.family: No Such Font
font.size: 20
axes.prop_cycle: cycler("color", ["k"])
lines.linewidth: 9
savefig.bbox: tight
savefig.dpi: 33
savefig.transparent: True
svg.fonttype: path
axes.unicode_minus: False
"""


def test_pictures_are_the_same_whatever_the_settings_are(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text(ODD)
    environment = os.environ | {"MPLBACKEND": "foo", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, plain_pictures.__file__, str(tmp_path)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "20.0 True\n"  # the settings stay as they were
    for name, data in plain_pictures.pictures().items():
        assert (tmp_path / name).read_bytes() == data, name


def test_settings_that_are_no_text_are_named(tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_bytes(b"font.size: \xff\xfe\n")
    program = "from marsupial.exports.style import plain_style\nwith plain_style(): pass"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert "UsageError: matplotlib can't read its settings, a matplotlibrc" in done.stderr


def test_a_figure_is_drawn_in_our_style_and_leaves_that_of_the_caller() -> None:
    events = synthetic_mission()
    with plain_style():
        plain = figure_file(mission_figure(events), "png")
    with mpl.rc_context({"text.usetex": True, "font.family": "No Such Font", "savefig.dpi": 10}):
        backend = mpl.rcParams["backend"]
        with plain_style():
            figure = mission_figure(events)
        assert figure._repr_png_() == plain
        figure.canvas.draw()
        assert (mpl.rcParams["text.usetex"], mpl.rcParams["savefig.dpi"]) == (True, 10)
        assert mpl.rcParams["backend"] == backend


def test_threads_that_draw_at_a_time_leave_the_settings_as_they_were() -> None:
    begun, before = threading.Barrier(2, timeout=10), dict(mpl.rcParams)
    seen: list[float] = []

    def draw(size: float) -> None:
        begun.wait()
        with plain_style({"font.size": size}):
            figure_file(Figure(figsize=(1, 1)), "png")
            seen.append(mpl.rcParams["font.size"])

    with mpl.rc_context({"font.size": 7}):
        threads = [threading.Thread(target=draw, args=(size,)) for size in (30.0, 40.0)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(seen) == [30, 40]
        assert mpl.rcParams["font.size"] == 7
    assert dict(mpl.rcParams) == before


def test_a_context_inside_of_another_adds_its_changes_and_an_error_ends_it() -> None:
    before = dict(mpl.rcParams)
    with plain_style({"font.size": 30}):
        with plain_style({"lines.linewidth": 5}):
            assert (mpl.rcParams["font.size"], mpl.rcParams["lines.linewidth"]) == (30, 5)
        assert (mpl.rcParams["font.size"], mpl.rcParams["lines.linewidth"]) == (30, 1.5)
    with pytest.raises(ZeroDivisionError), plain_style({"font.size": 30}):
        raise ZeroDivisionError
    assert dict(mpl.rcParams) == before
