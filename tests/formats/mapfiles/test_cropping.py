"""Frames that are mostly unknown, as packages for mapping save them, cropped to what is known."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from marsupial.errors import MapError
from marsupial.formats.mapfiles import images
from marsupial.formats.mapfiles.cropping import WHOLE_CELLS, known_part, known_window
from marsupial.formats.mapfiles.images import SMALL_BYTES
from marsupial.formats.mapfiles.nav2 import read_nav2
from marsupial.formats.scenario import read_scenario
from marsupial.library.exploring import explore
from marsupial.library.scenarios import load_scenario
from marsupial.model.grid import FLOOR, OBSTACLE, UNKNOWN, Grid, MapReading

ROOM = np.full((40, 60), 254, dtype=np.uint8)
ROOM[[0, -1]] = ROOM[:, [0, -1]] = 0
ROOM[0, 0] = 205
SIDE, LEFT, TOP = 1500, 1200, 900  # of the frame, and the place of the room in it


def frame(unknown: int = 205, room: np.ndarray = ROOM) -> np.ndarray:
    found = np.full((SIDE, SIDE), unknown, dtype=np.uint8)
    found[TOP : TOP + room.shape[0], LEFT : LEFT + room.shape[1]] = room
    return found


def write(folder: Path, image: Image.Image, name: str = "map.png", **fields: object) -> Path:
    header = {"image": name, "resolution": 0.05, "origin": [-51.2, -51.2, 0.0], "negate": 0}
    image.save(folder / name)
    path = folder / "map.yaml"
    path.write_text(yaml.safe_dump(header | {"occupied_thresh": 0.65, "free_thresh": 0.196} | fields))
    return path


@pytest.mark.parametrize("name", ["map.png", "map.pgm", "map.bmp"])
@pytest.mark.parametrize("yaw", [0.0, 1.0])
def test_the_known_part_of_a_large_frame_is_read_where_it_is_in_the_world(
    tmp_path: Path, name: str, yaw: float
) -> None:
    path = write(tmp_path, Image.fromarray(frame()), name, origin=[-51.2, -51.2, yaw])
    reading = read_nav2(path)
    assert reading.grid.cells.shape == (42, 62)  # one unknown row and column stay along each edge
    assert reading.format.endswith("the known part of 1500 x 1500 cells")
    whole = Grid(cells=np.zeros((SIDE, SIDE), dtype=np.uint8), resolution_m=0.05, origin_m=(-51.2, -51.2, yaw))
    for x, y in ((LEFT + 3.5, SIDE - TOP - 5.5), (LEFT + 20.5, SIDE - TOP - 10.5)):
        cell = reading.grid.cell_at_m(*whole.point_m(x, y))
        assert (cell.x + LEFT - 1, cell.y + SIDE - TOP - 41) == (math.floor(x), math.floor(y))
    assert (
        np.flipud(reading.grid.cells)[1:-1, 1:-1].tolist()
        == np.select([ROOM == 0, ROOM == 205], [OBSTACLE, UNKNOWN], FLOOR).tolist()
    )


def test_what_is_unknown_follows_from_the_header(tmp_path: Path) -> None:
    negated = write(tmp_path, Image.fromarray(255 - frame()), negate=1)
    assert read_nav2(negated).grid.cells.shape == (42, 62)
    raw = np.where(frame() == 254, 0, np.where(frame() == 0, 100, 255)).astype(np.uint8)
    assert read_nav2(write(tmp_path, Image.fromarray(raw), mode="raw")).grid.cells.shape == (42, 62)
    clear = Image.fromarray(frame(unknown=0)).convert("LA")
    clear.putalpha(Image.fromarray(frame(unknown=0, room=np.full((40, 60), 255, dtype=np.uint8))))
    assert read_nav2(write(tmp_path, clear)).grid.cells.shape == (42, 62)
    assert read_nav2(write(tmp_path, Image.fromarray(frame()).convert("RGB"))).grid.cells.shape == (42, 62)
    assert read_nav2(write(tmp_path, Image.fromarray(frame()).quantize(4))).grid.cells.shape == (42, 62)


def test_small_maps_and_maps_known_to_their_edges_are_read_whole(tmp_path: Path) -> None:
    small = np.full((100, 100), 205, dtype=np.uint8)
    small[50, 50] = 254
    assert read_nav2(write(tmp_path, Image.fromarray(small))).grid.cells.shape == (100, 100)
    edges = frame()
    edges[[0, -1]] = edges[:, [0, -1]] = 0
    reading = read_nav2(write(tmp_path, Image.fromarray(edges), "map.pgm"))
    assert (reading.grid.cells.shape, reading.frame) == ((SIDE, SIDE), None)


def test_a_known_part_that_is_too_large_for_a_small_file_is_refused(tmp_path: Path) -> None:
    for grey in (254, 205):  # all known, and nothing
        path = write(tmp_path, Image.new("L", (1500, 1500), grey))
        assert (tmp_path / "map.png").stat().st_size < SMALL_BYTES
        with pytest.raises(
            MapError, match="image: 1500 x 1500 cells are more than the limit of 2125000 for a compressed"
        ):
            read_nav2(path)


def test_a_mask_of_the_size_of_the_file_paints_the_known_part(tmp_path: Path) -> None:
    write(tmp_path, Image.fromarray(frame()))
    mask = np.full((SIDE, SIDE), 255, dtype=np.uint8)
    mask[TOP + 10, LEFT + 20] = 128
    Image.fromarray(mask).save(tmp_path / "mask.png")
    start = [round(-51.2 + 0.05 * (LEFT + 24.5), 3), round(-51.2 + 0.05 * (SIDE - TOP - 19.5), 3)]
    (tmp_path / "yard.yaml").write_text(
        f"""format: marsupial-scenario
version: 1
map: {{file: map.yaml, mask: {{file: mask.png, greys: {{floor: 255, rough: 128}}}}}}
robot_types: [{{name: c, role: carrier, speed_mps: 1, sensor_range_m: 2, radius_m: 0, terrains: [floor], capacity: 0}}]
team: [{{name: c1, type: c, start: {start}}}]
"""
    )
    scenario = read_scenario(tmp_path / "yard.yaml")
    y, x = np.nonzero(scenario.grid.cells == 2)
    assert (x.tolist(), y.tolist()) == ([21], [42 - 1 - 11])
    (member,) = scenario.team
    assert member.start is not None
    assert scenario.grid.centre_m(member.start) == pytest.approx(start)


def test_the_known_part_of_a_map_of_another_format_is_its_known_window() -> None:
    cells = np.full((1600, 1400), UNKNOWN, dtype=np.uint8)
    cells[3, 1399] = FLOOR
    reading = MapReading(grid=Grid(cells=cells, resolution_m=0.1, origin_m=(1.0, 2.0, 0.0)), format="drawn")
    assert cells.size > WHOLE_CELLS
    part = known_part(reading)
    assert part.grid.cells.tolist() == [[UNKNOWN, UNKNOWN], [UNKNOWN, FLOOR], [UNKNOWN, UNKNOWN]]
    assert part.grid.origin_m == (140.8, 2.2, 0.0)
    assert known_window([(0, cells != UNKNOWN)], cells.shape) == (2, 5, 1398, 1400)


def test_a_mission_on_a_cropped_frame_goes_as_on_the_map_without_it(tmp_path: Path) -> None:
    walled = np.pad(ROOM, 1, constant_values=205)
    alone = tmp_path / "alone"
    alone.mkdir()
    origin = [round(-51.2 + 0.05 * (LEFT - 1), 9), round(-51.2 + 0.05 * (SIDE - TOP - 41), 9), 0.0]
    maps = [write(tmp_path, Image.fromarray(frame())), write(alone, Image.fromarray(walled), origin=origin)]
    scenarios = [load_scenario(str(path), 1, 0).scenario for path in maps]
    runs = [explore(scenario, "closest-frontier", steps=1) for scenario in scenarios]
    assert runs[0].events == runs[1].events


def test_real_buildings_are_read_from_small_files(shared_maps: Path, tmp_path: Path) -> None:
    floors = [Image.open(shared_maps / "buildings" / f"{name}.png") for name in ("kth_a1", "kth_a2", "kth_a3")]
    stacked = np.full(
        (sum(floor.height for floor in floors), max(floor.width for floor in floors)), 205, dtype=np.uint8
    )
    top = 0
    for floor in floors:
        stacked[top : top + floor.height, : floor.width] = np.asarray(floor)
        top += floor.height
    path = write(tmp_path, Image.fromarray(stacked))
    assert (tmp_path / "map.png").stat().st_size < images.SMALL_BYTES
    assert read_nav2(path).grid.cells.size > 3_500_000
