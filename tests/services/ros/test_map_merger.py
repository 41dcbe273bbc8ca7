"""Robots that map alone: their maps, each in a frame of its own, are one map of the mission."""

import math
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets")

import numpy as np
from fake_ros import link_of
from ros_missions import drive, robots_in_rooms
from ros_parts import grid_message, moved, settings_of
from support.services.servers import Server

from marsupial.errors import MapError, ScenarioError
from marsupial.formats.mapfiles.occupancy import Occupancy, OccupancyUpdate
from marsupial_ros.map_merger import MapMerger
from marsupial_ros.messages import occupancy_in
from marsupial_ros.transforms import Frames, Transform


def frames(**links: Transform) -> list[Frames]:
    """Return frames with these links into the map's frame, after others without them."""
    found = Frames()
    for child, transform in links.items():
        found.add("map", child, transform, None)
    return [Frames(), found]


def occupancy(rows: list[list[int]], x: float = 0.0, y: float = 0.0, resolution_m: float = 1.0) -> Occupancy:
    return occupancy_in(grid_message(rows, x, y, resolution_m))


def test_an_obstacle_of_one_map_stays_and_free_beats_unknown() -> None:
    merger = MapMerger("map", frames(a=moved(0, 0), b=moved(2, 0)))
    merger.take("/a", "a", occupancy([[0, 0, 100, -1]]), 1.0)
    whole = merger.take("/b", "b", occupancy([[0, 0, 100]]), 2.0)
    assert whole.values.tolist() == [[0, 0, 100, 0, 100]]
    assert whole.origin_m == (0.0, 0.0, 0.0)
    assert merger.made_s == 1.0


@pytest.mark.parametrize(
    ("x", "y", "yaw", "origin", "values"),
    [
        (2.0, -1.0, 0.0, (3.0, 0.0), [[1, 2, 3], [4, 5, 6]]),
        (0.0, 0.0, math.pi / 2, (-3.0, 1.0), [[4, 1], [5, 2], [6, 3]]),
        (0.0, 0.0, math.pi, (-4.0, -3.0), [[6, 5, 4], [3, 2, 1]]),
        (10.3, 0.0, 0.0, (11.0, 1.0), [[1, 2, 3, -1], [4, 5, 6, -1]]),
    ],
)
def test_a_map_is_laid_where_its_frame_is(
    x: float, y: float, yaw: float, origin: tuple[float, float], values: list[list[int]]
) -> None:
    merger = MapMerger("map", frames(a=moved(x, y, yaw)))
    whole = merger.take("/a", "a", occupancy([[1, 2, 3], [4, 5, 6]], 1.0, 1.0), 0.0)
    assert whole.origin_m[:2] == pytest.approx(origin)
    assert whole.values.tolist() == values


def test_a_finer_map_has_the_cells_of_the_first_one() -> None:
    merger = MapMerger("map", frames(a=moved(0, 0), b=moved(0, 0)))
    merger.take("/a", "a", occupancy([[0, 0], [0, 0]]), 0.0)
    fine = np.zeros((4, 8), dtype=int)
    fine[:, 6:] = 100
    whole = merger.take("/b", "b", occupancy(fine.tolist(), resolution_m=0.5), 0.0)
    assert whole.resolution_m == 1.0
    assert whole.values.tolist() == [[0, 0, 0, 100]] * 2


def test_an_update_changes_its_own_map_only() -> None:
    merger = MapMerger("map", frames(a=moved(0, 0), b=moved(5, 0)))
    update = OccupancyUpdate(1, 0, np.array([[100]], dtype=np.int8))
    assert merger.update("/a", update, 0.0) is None
    merger.take("/a", "a", occupancy([[0, 0]]), 0.0)
    merger.take("/b", "b", occupancy([[0, 0]]), 0.0)
    whole = merger.update("/a", update, 3.0)
    assert whole is not None
    assert whole.values.tolist() == [[0, 100, -1, -1, -1, 0, 0]]


def test_a_map_without_a_transform_or_far_away_is_refused_and_changes_nothing() -> None:
    merger = MapMerger("map", frames(a=moved(0, 0), far=moved(900_000, 900_000)))
    with pytest.raises(MapError, match="no transform from its frame 'b' to 'map' yet"):
        merger.take("/b", "b", occupancy([[0]], resolution_m=0.1), 0.0)
    assert merger.take("/a", "a", occupancy([[0]]), 0.0).values.tolist() == [[0]]
    with pytest.raises(MapError, match="more than the limit of"):
        merger.take("/far", "far", occupancy([[0]]), 0.0)
    assert merger.take("/a", "a", occupancy([[100]]), 0.0).values.tolist() == [[100]]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{topics: [/a, /b], topic: /c}", "map.topic: can't be given beside topics"),
        ("{topics: [/a, /a]}", "map.topics: must not name a topic twice"),
        ("{topics: []}", "map.topics: must be a list of texts"),
    ],
)
def test_topics_of_maps_are_checked(tmp_path: Path, text: str, problem: str) -> None:
    with pytest.raises(ScenarioError, match=problem):
        settings_of(tmp_path, {"map": text})


async def test_robots_whose_maps_are_apart_explore_all(server: Server, tmp_path: Path) -> None:
    """The right half is in a frame of its own, turned by a quarter."""

    def half(message: dict[str, Any], *, right: bool) -> dict[str, Any]:
        info, position = message["info"], message["info"]["origin"]["position"]
        cells = np.array(message["data"]).reshape(info["height"], -1).copy()
        middle = round((3.0 - position["x"]) / info["resolution"])
        cells[:, : max(0, middle - 2)] = -1 if right else cells[:, : max(0, middle - 2)]
        cells[:, max(0, middle + 2) :] = cells[:, max(0, middle + 2) :] if right else -1
        if not right:
            return {**message, "data": cells.ravel().tolist()}
        wide = info["width"] * info["resolution"]
        x, y = position["y"] - 1.0, -(position["x"] + wide - 5.0)
        origin = {**info["origin"], "position": {"x": x, "y": y, "z": 0.0}}
        turned = {**info, "width": info["height"], "height": info["width"], "origin": origin}
        header, data = {**message["header"], "frame_id": "right"}, np.rot90(cells).ravel().tolist()
        return {"header": header, "info": turned, "data": data}

    async with robots_in_rooms(map="{topics: [/left/map, /right/map], compression: none}") as (ros, user):
        ros.maps = {"/left/map": lambda one: half(one, right=False), "/right/map": lambda one: half(one, right=True)}
        ros.links = [link_of("map", "right", (5.0, 1.0), math.pi / 2, 0.0)]
        outcome = await drive(*user.bridge(server, ros, tmp_path))
    assert outcome.ended is not None, user.said
    assert outcome.ended["status"] == "complete", (outcome, user.said)
