from pathlib import Path

import numpy as np
import pytest

from marsupial.errors import MapError
from marsupial.formats.mapfiles.movingai import read_movingai
from marsupial.model import FLOOR, OBSTACLE, ROUGH, LegendEntry

F, O, R = FLOOR, OBSTACLE, ROUGH  # noqa: E741

SMALL = "type octile\nheight 2\nwidth 3\nmap\n.@G\nSTW\n"


def write(folder: Path, text: str | bytes, name: str = "small.map") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def map_problems(path: Path) -> list[str]:
    with pytest.raises(MapError) as caught:
        read_movingai(path)
    return [str(problem) for problem in caught.value.problems]


def test_the_last_row_of_the_file_is_row_0(tmp_path: Path) -> None:
    grid = read_movingai(write(tmp_path, SMALL)).grid
    assert grid.cells.tolist() == [[R, O, O], [F, O, F]]
    assert (grid.resolution_m, grid.origin_m) == (1.0, (0.0, 0.0, 0.0))


def test_every_character_has_its_meaning_and_water_is_mentioned(tmp_path: Path) -> None:
    reading = read_movingai(write(tmp_path, "type octile\nheight 1\nwidth 8\nmap\n..GS@OTW"))
    assert reading.grid.cells.tolist() == [[F, F, F, R, O, O, O, O]]
    assert reading.legend[:3] == (
        LegendEntry(symbol="'.'", code=FLOOR, cells=2),
        LegendEntry(symbol="'G'", code=FLOOR, cells=1),
        LegendEntry(symbol="'S'", code=ROUGH, cells=1),
    )
    assert reading.warnings[1:] == (
        "'S' became rough ground in 1 cell (MovingAI's swamp): robots without rough among their terrains keep out; "
        "if it is a service point of the League of Robot Runners, write '.' instead",
        "1 cell of water ('W') became obstacles: no robot on land gets there",
    )
    assert reading.walled


def test_a_map_with_emitters_is_one_of_the_league_of_robot_runners_whose_service_points_are_floor(
    tmp_path: Path,
) -> None:
    reading = read_movingai(write(tmp_path, "type octile\nheight 1\nwidth 6\nmap\n@E.SST"))
    assert reading.grid.cells.tolist() == [[O, F, F, F, F, O]]
    assert LegendEntry(symbol="'S'", code=FLOOR, cells=2) in reading.legend
    (warning,) = reading.warnings[1:]
    assert warning.startswith("'E' in 1 cell and 'S' in 2 became floor, as in maps of the League of Robot Runners")


@pytest.mark.parametrize(
    "text",
    [
        SMALL.replace("\n", "\r\n"),
        SMALL.rstrip("\n"),
        SMALL + "\n\n",
        SMALL.replace("\n", "\r\n") + "\r\n",
        SMALL.replace("height 2\nwidth 3", "width 3\nheight 2"),
        SMALL.replace(".@G", ".@G  "),
        "\ufeff" + SMALL,
        SMALL.encode("utf-16"),
        ("\ufeff" + SMALL).encode("utf-16-be"),
    ],
    ids=["crlf", "no final newline", "blank lines at the end", "crlf and a blank line", "width first", "spaces",
         "mark", "utf-16", "utf-16 of the other order"],
)  # fmt: skip
def test_other_ways_to_write_the_same_map_are_accepted(tmp_path: Path, text: str | bytes) -> None:
    assert read_movingai(write(tmp_path, text)).grid.cells.tolist() == [[R, O, O], [F, O, F]]


def test_rows_of_the_wrong_width_and_unknown_characters_are_named_by_place(tmp_path: Path) -> None:
    text = "type octile\nheight 3\nwidth 3\nmap\n..x\n.\xe9\n....\n"
    assert map_problems(write(tmp_path, text.encode("latin-1"))) == [
        "line 5: unknown character 'x' in column 3; known are . G S @ O T W E",
        "line 6: has 2 cells, but width is 3",
        "line 6: unknown character '\\\\xe9' in column 2; known are . G S @ O T W E",
        "line 7: has 4 cells, but width is 3",
    ]


@pytest.mark.parametrize("rows", [1, 3])
def test_a_wrong_number_of_rows_is_named(tmp_path: Path, rows: int) -> None:
    text = "type octile\nheight 2\nwidth 3\nmap\n" + "...\n" * rows
    (problem,) = map_problems(write(tmp_path, text))
    assert problem == f"line {rows + 4}: ends the map after {rows} rows, but height is 2"


def test_a_wrong_header_is_named_at_once(tmp_path: Path) -> None:
    assert map_problems(write(tmp_path, "type tile\nheight two\nwidth -3\nMAP\n")) == [
        "line 1: must be `type octile`, got 'type tile'",
        "line 2: must be `height N` or `width N`, got 'height two'",
        "line 3: must be `height N` or `width N`, got 'width -3'",
        "line 4: must be `map`, got 'MAP'",
    ]


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ("height 2\nheight 2", "height and width must both be given"),
        ("height 0\nwidth 3", "height and width must be positive, got 3 x 0"),
        ("height 20000\nwidth 20000", "20000 x 20000 cells are more than the limit of 100000000"),
    ],
)
def test_impossible_sizes_are_named(tmp_path: Path, sizes: str, message: str) -> None:
    assert map_problems(write(tmp_path, f"type octile\n{sizes}\nmap\n...\n")) == [f"line 3: {message}"]


@pytest.mark.parametrize("text", [b"", b"\n\n", b"\x00\xff" * 50])
def test_files_that_are_no_map_are_refused_in_a_line(tmp_path: Path, text: bytes) -> None:
    (problem,) = map_problems(write(tmp_path, text))
    assert problem.startswith("is no MovingAI map: line 1 must be `type octile`" if text.strip() else "is empty")


def test_a_file_full_of_faults_names_only_the_first_ten(tmp_path: Path) -> None:
    problems = map_problems(write(tmp_path, "type octile\nheight 50\nwidth 3\nmap\n" + "..\n" * 50))
    assert len(problems) == 11
    assert problems[-1] == "and 40 more faults like these"


# Real maps

PASSABLE = {
    "room-32-32-4": (32, 32, 682), "room-64-64-16": (64, 64, 3646), "maze-32-32-2": (32, 32, 666),
    "random-32-32-20": (32, 32, 819), "Boston_0_256": (256, 256, 47768), "warehouse-10-20-10-2-1": (161, 63, 5699),
    "arena": (49, 49, 2054), "den312d": (65, 81, 2445),
}  # fmt: skip


@pytest.mark.parametrize("name", PASSABLE)
def test_real_maps_have_their_size_and_number_of_passable_cells(shared_maps: Path, name: str) -> None:
    path = shared_maps / "movingai" / f"{name}.map"
    grid = read_movingai(path).grid
    assert (grid.width, grid.height, np.count_nonzero(grid.cells)) == PASSABLE[name]
    rows = path.read_text().split("map\n", 1)[1].split()
    assert [[c == "." for c in row] for row in reversed(rows)] == (grid.cells == FLOOR).tolist()
