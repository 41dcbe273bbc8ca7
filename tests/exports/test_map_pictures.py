import io
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.transforms import Bbox
from PIL import Image
from rich.console import Console
from support.missions.small_teams import drawn_grid

from marsupial.cli.display.map_picture import QUARTERS, characters, coarse_map, map_picture
from marsupial.exports.mapclasses import LOOKS, MapClass, map_classes
from marsupial.exports.mapfigure import best_place, map_figure, places_beside
from marsupial.generators.builtin import builtin_scenario
from marsupial.maps.reach import parts
from marsupial.model.grid import Cell, CellArray, Grid
from marsupial.model.robots import default_types

KINDS = default_types(1)
HALL = ("###########", "#.........#", "#.........#", "#.........#", "##,########", "#,,,,#..??#", "###########")
OPEN = ("####", "#..,", "#..#", "####")


def lines(classes: CellArray, **look: bool) -> list[str]:
    return ["".join(letter for letter, _ in line) for line in characters(classes, **look)]


def office() -> CellArray:
    scenario = builtin_scenario("office", 2, 2)
    return map_classes(scenario.grid, scenario.robot_types)


def test_cells_are_classified_by_the_types_that_can_stand_on_them() -> None:
    classes = map_classes(drawn_grid(*HALL), KINDS)
    assert classes[4, 5] == MapClass.CARRIERS
    assert classes[2, 2] == classes[1, 3] == MapClass.ROVERS
    assert classes[1, 6] == classes[1, 7] == MapClass.ISLAND
    assert classes[1, 8] == MapClass.UNSEEN
    assert (classes[0] == MapClass.WALL).all()


def test_islands_too_small_to_see_are_not_distinguished() -> None:
    assert MapClass.ISLAND in map_classes(drawn_grid(*HALL, resolution_m=0.2), KINDS)
    assert MapClass.ISLAND not in map_classes(drawn_grid(*HALL, resolution_m=0.15), KINDS)


def test_ground_that_is_open_to_the_border_is_a_leak() -> None:
    assert map_classes(drawn_grid(*OPEN), KINDS)[2, 3] == MapClass.LEAK
    assert MapClass.LEAK not in map_classes(drawn_grid(*HALL), KINDS)


def test_ground_where_no_robot_fits_is_narrow() -> None:
    slim = drawn_grid("###", "#.#", "###")
    wide = tuple(kind for kind in KINDS if kind.name == "carrier")
    assert map_classes(slim, [replace(wide[0], radius_m=2.0)])[1, 1] == MapClass.NARROW


def test_the_picture_has_the_colours_of_all_that_occurs_and_says_what_they_are() -> None:
    grid = drawn_grid(*HALL)
    classes = map_classes(grid, KINDS)
    starts = {"carrier1": Cell(4, 4)}
    png = map_figure(grid, classes, "hall", starts, kind="png", warnings=["something is odd"])
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).reshape(-1, 3)
    shown = {"#" + bytes(colour).hex() for colour in np.unique(pixels, axis=0)}
    assert {LOOKS[MapClass(int(kind))].colour for kind in np.unique(classes)} <= shown
    svg = map_figure(grid, classes, "hall", starts, kind="svg", warnings=["something is odd"])
    text = "\n".join(ElementTree.fromstring(svg).itertext())
    assert {"hall", "carrier1", "start", "obstacle", "unknown", "only rovers can"} <= {
        line.strip() for line in text.splitlines()
    }
    assert "! something is odd" in text
    assert "leak" not in text


def shown_texts(grid: Grid, starts: dict[str, Cell], **look: str) -> set[str]:
    svg = map_figure(grid, map_classes(grid, KINDS), "hall", starts, kind="svg", **look)
    return {line.strip() for line in "\n".join(ElementTree.fromstring(svg).itertext()).splitlines()}


def test_axes_are_metres_of_the_map_frame() -> None:
    texts = shown_texts(replace(drawn_grid(*HALL), origin_m=(-10.3, -4.7, 0.0)), {})
    metres = {text for text in texts if text.endswith(" m")}
    assert {"-10 m", "0 m"} <= metres
    assert max(float(text.removesuffix(" m")) for text in metres) <= 2.3
    assert not any("corner" in text for text in texts)


def test_axes_of_a_rotated_map_are_labelled_as_relative_to_its_corner() -> None:
    texts = shown_texts(replace(drawn_grid(*HALL), origin_m=(-10.3, -4.7, 0.52)), {})
    assert "metres from the lower left corner: the map is turned by 29.8° in the map frame" in texts
    assert not any(text.startswith("-") for text in texts)


def test_axes_count_in_metres_of_the_map_frame() -> None:
    texts = shown_texts(replace(drawn_grid(*HALL), origin_m=(-10.3, 500.0, 0.0)), {})
    assert {"-10 m", "507 m"} <= set(texts)


ROOMY = Bbox.from_extents(0, 0, 1000, 1000)


def place_beside(x: float, *taken: Bbox) -> tuple[float, int]:
    """Return how far right of its mark the middle of a name is, and its ring."""
    found = best_place(places_beside((x, 500.0), (50.0, 12.0), 1.0), taken, ROOMY)
    return found.box.x0 + 25.0 - x, found.ring


def test_names_stand_beside_their_marks_clear_of_others() -> None:
    assert place_beside(500.0) == (34.0, 0)
    assert place_beside(500.0, Bbox.from_extents(510, 490, 540, 510))[0] < -25
    assert place_beside(990.0)[0] < -25


def test_names_without_room_beside_their_marks_stand_farther_off() -> None:
    assert place_beside(500.0, Bbox.from_extents(480, 480, 520, 520))[1] > 0


def test_small_maps_are_letters_cell_by_cell_where_there_are_no_blocks() -> None:
    classes = np.full((4, 6), MapClass.CARRIERS, dtype=np.uint8)
    classes[:, :2] = MapClass.WALL
    classes[:, 4:] = MapClass.UNSEEN
    assert lines(classes, blocks=False, plain=True) == ["#. "]
    assert lines(classes, blocks=True, plain=True) == ["█. "]


def test_quarters_of_a_character_show_separate_walls() -> None:
    classes = np.full((4, 2), MapClass.CARRIERS, dtype=np.uint8)
    classes[3, 0] = MapClass.WALL  # the uppermost row
    assert lines(classes, blocks=True, plain=True) == ["▘"]
    classes[0, 1] = MapClass.WALL
    assert lines(classes, blocks=True, plain=True) == ["▚"]


def test_a_leak_is_seen_however_small() -> None:
    classes = np.full((40, 40), MapClass.CARRIERS, dtype=np.uint8)
    classes[17, 3] = MapClass.LEAK
    assert (coarse_map(classes, 10) == MapClass.LEAK).sum() == 1


def test_rooms_of_an_office_stay_rooms_at_80_by_24() -> None:
    classes = office()
    block = max(-(-classes.shape[1] // 160), -(-classes.shape[0] // 80))
    assert block > 1
    closed = parts(coarse_map(classes, block) != MapClass.WALL)
    whole = parts(classes != MapClass.WALL)
    assert closed[1] == whole[1]
    console = Console(file=io.StringIO(), width=80, height=24, force_terminal=True, color_system="truecolor")
    drawn = map_picture(classes, console, blocks=True).plain.splitlines()
    assert len(drawn) <= 23
    assert max(map(len, drawn)) <= 80


def painted(no_color: bool, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.delenv("NO_COLOR", raising=False)
    if no_color:
        monkeypatch.setenv("NO_COLOR", "1")
    console = Console(file=io.StringIO(), width=80, height=24, force_terminal=True, color_system="truecolor")
    console.print(map_picture(map_classes(drawn_grid(*HALL), KINDS), console, blocks=True))
    return console.file.getvalue()  # type: ignore[attr-defined, no-any-return]


def test_without_colours_letters_replace_them(monkeypatch: pytest.MonkeyPatch) -> None:
    coloured, plain = painted(False, monkeypatch), painted(True, monkeypatch)
    assert "\x1b[" in coloured
    assert "\x1b[" not in plain
    for kind in (MapClass.CARRIERS, MapClass.ROVERS, MapClass.ISLAND):
        assert f"{LOOKS[kind].letter} {LOOKS[kind].text}" in plain
        assert f"{LOOKS[kind].letter} {LOOKS[kind].text}" not in coloured


def test_ascii_is_enough() -> None:
    console = Console(file=io.StringIO())
    map_picture(map_classes(drawn_grid(*HALL), KINDS), console, blocks=False).plain.encode("ascii")
    with pytest.raises(UnicodeEncodeError):
        QUARTERS.encode("ascii")
