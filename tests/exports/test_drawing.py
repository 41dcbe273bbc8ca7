import io
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from support.missions.growing_mission import growing_mission
from support.missions.synthetic_mission import synthetic_mission

from marsupial.exports.drawing import MissionDrawing
from marsupial.exports.ground import coarse, frontier, ground_image
from marsupial.exports.trails import Activity, stretches
from marsupial.exports.write import ExportOptions, export_mission
from marsupial.mission.playback import Playback
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN
from marsupial.replay.page import file_text
from marsupial.replay.palette import DARK, LIGHT

EVENTS = synthetic_mission()


def figure(suffix: str, at_ms: int | None = None) -> bytes:
    return export_mission(EVENTS, suffix, ExportOptions(at_ms=at_ms))


def texts(svg: bytes) -> list[str]:
    return [
        "".join(element.itertext()).strip() for element in ElementTree.fromstring(svg).iter() if "text" in element.tag
    ]


def colours(pixels: np.ndarray) -> set[str]:
    return {"#" + bytes(colour).hex() for colour in np.unique(pixels.reshape(-1, 3), axis=0)}


def test_a_figure_describes_each_robot_s_action_at_its_moment() -> None:
    at_start, in_yard = (texts(figure(".svg", at_ms=t_ms)) for t_ms in (0, 12_000))
    assert {"two halves", "0:00", "carrier1", "rover1_1", "aboard carrier1", "drives"} <= set(at_start)
    assert {"0:12", "explores", "waits", "aboard carrier1"} <= set(in_yard)
    assert {"unknown", "floor", "obstacle", "frontier", "undocked", "docked"} <= set(at_start)
    assert "rough" in at_start


def test_a_figure_rounds_its_time_as_tables_do() -> None:
    assert "0:13" in texts(figure(".svg", at_ms=12_600))


def test_a_moment_outside_the_mission_is_its_start_or_end() -> None:
    assert "0:26" in texts(figure(".svg", at_ms=10**9))
    assert "0:26" in texts(figure(".svg"))


@pytest.mark.parametrize("kind", [".svg", ".pdf", ".png"])
def test_the_same_figure_is_the_same_bytes(kind: str) -> None:
    assert figure(kind, at_ms=5000) == figure(kind, at_ms=5000)


@pytest.mark.parametrize("palette", [LIGHT, DARK], ids=["light", "dark"])
def test_a_picture_shows_ground_robots_and_activities_in_the_palette_s_colours(palette: object) -> None:
    chosen = LIGHT if palette is LIGHT else DARK
    drawing = MissionDrawing(Playback(EVENTS), palette=chosen)
    shown = colours(drawing.frame(12_000))
    ground = {chosen.page, chosen.unknown, chosen.free, chosen.wall, chosen.other, chosen.frontier}
    robots = {chosen.families[0][0], chosen.families[0][1], chosen.families[0][2]}
    assert ground | robots | {chosen.actions["explore"], chosen.actions["undock"]} <= shown


def test_pictures_are_the_same_whichever_was_drawn_before() -> None:
    drawing = MissionDrawing(Playback(EVENTS), dpi=50)
    first = drawing.frame(3000)
    assert (drawing.frame(14_000) != first).any()
    assert (drawing.frame(3000) == first).all()


def test_a_map_that_has_grown_is_shown_whole() -> None:
    pixels = np.asarray(Image.open(io.BytesIO(export_mission(growing_mission(), ".png", ExportOptions()))))
    assert LIGHT.wall in colours(pixels[::2, ::2, :3])


def test_lanes_are_what_robots_do() -> None:
    found = stretches(Playback(EVENTS))["rover1_1"]
    minutes = [round(60 * start, 3) for start, _ in found[Activity.EXPLORE]]
    assert minutes == [10.002, 12.503]
    assert found[Activity.ABOARD][0] == (0.0, pytest.approx(5.001 / 60))
    assert found[Activity.DOCK] == [(pytest.approx(16.005 / 60), pytest.approx(10 / 60))]


def test_where_known_floor_ends_is_the_frontier() -> None:
    cells = np.array([[FLOOR, FLOOR, UNKNOWN], [OBSTACLE, OBSTACLE, UNKNOWN]], dtype=np.uint8)
    assert frontier(cells).tolist() == [[False, True, False], [False, False, False]]
    assert colours(ground_image(cells, LIGHT)) == {LIGHT.free, LIGHT.frontier, LIGHT.wall, LIGHT.unknown}


def test_walls_of_one_cell_stay_walls_in_a_small_picture() -> None:
    cells = np.full((12, 12), FLOOR, dtype=np.uint8)
    cells[5] = OBSTACLE
    assert (coarse(cells, 4)[1] == OBSTACLE).all()
    assert (coarse(cells, 4)[[0, 2]] == FLOOR).all()


def test_the_page_has_the_same_words_in_its_keys() -> None:
    legend = file_text("draw/legend.js")
    for word in [*(does for does in Activity if does is not Activity.WAIT), "unknown"]:
        assert re.search(rf'"{word}\b', legend), word
