import base64
import io
import json
import struct
import zlib
from itertools import pairwise
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError
from service_requests import pointers, problem
from support.waiting import HANG_S

from marsupial.errors import InputError
from marsupial.model.grid import Cell
from marsupial_service.analyses.maps import MapState, map_state_of
from marsupial_service.examples.demos import DEMOS
from marsupial_service.problems import of_location, of_path
from marsupial_service.schemas.mapstates import MapStateBody
from marsupial_service.settings import ServiceLimits

GREYS = {"#": 0, ".": 254, "?": 205}
ROWS = ["######", "#....?", "#....?", "######"]
YAML = "image: {image}\nresolution: 0.5\norigin: [10, 5, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def picture(rows: list[str], kind: str = "PNG", greys: dict[str, int] | None = None) -> str:
    cells = np.array([[(greys or GREYS)[c] for c in row] for row in rows], dtype=np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(cells).save(buffer, "PPM" if kind == "PGM" else kind)
    return base64.b64encode(buffer.getvalue()).decode()


def map_state(**changes: Any) -> dict[str, Any]:
    sizes = {"speed_mps": 1, "sensor_range_m": 5, "radius_m": 0.1}
    carrier = {"name": "carrier", "role": "carrier", **sizes, "terrains": ["floor"], "capacity": 2}
    rover = {"name": "rover", "role": "rover", **sizes, "terrains": ["floor", "rough"], "dock_s": 4, "undock_s": 2}
    found = {
        "map": {"rows": ROWS, "resolution_m": 0.5, "origin_m": [10, 5, 0]},
        "robot_types": [carrier, rover],
        "robots": [{"name": "c", "type": "carrier", "cell": [1, 1]}, {"name": "r", "type": "rover", "carrier": "c"}],
    }
    return {**found, **changes}


def read(limits: ServiceLimits | None = None, **changes: Any) -> MapState:
    return map_state_of(MapStateBody.model_validate(map_state(**changes)), limits or ServiceLimits())


def refusal(**changes: Any) -> dict[str, str]:
    """Return the errors in a map state by JSON pointer."""
    body = {"map_state": map_state(**changes)}
    found: dict[str, str] = {}
    try:
        read(**changes)
    except ValidationError as error:
        wrong = [(of_location(("map_state", *one["loc"]), body), one["msg"]) for one in error.errors()]
    except InputError as error:
        wrong = [(of_path(problem.path, body), problem.message) for problem in error.problems]
    else:
        raise AssertionError("it was taken")
    for pointer, text in wrong:
        found[pointer] = found.get(pointer, "") + text + "\n"
    return found


@pytest.mark.parametrize(
    "given",
    [
        {"image": picture(ROWS), "resolution_m": 0.5, "origin_m": [10, 5, 0], "free_thresh": 0.196},
        {"image": picture(ROWS, "PGM"), "resolution_m": 0.5, "origin_m": [10, 5, 0], "free_thresh": 0.196},
        {"nav2": {"yaml": YAML.format(image="/etc/passwd"), "image": picture(ROWS)}},
    ],
)
def test_a_map_means_the_same_however_it_is_sent(given: dict[str, Any]) -> None:
    drawn, sent = read().grid, read(map=given).grid
    assert np.array_equal(sent.cells, drawn.cells)
    assert (sent.resolution_m, sent.origin_m) == (drawn.resolution_m, drawn.origin_m) == (0.5, (10.0, 5.0, 0.0))


def test_a_mask_paints_terrain() -> None:
    mask = {"image": picture(["______", "_a.a._", "______", "______"], greys={"_": 255, "a": 7, ".": 255})}
    state = read(map={**map_state()["map"], "mask": {**mask, "greys": {"rough": 7, "floor": [255]}}})
    assert state.grid.cells[2].tolist() == [0, 2, 1, 2, 1, 255]


def test_a_mask_of_a_large_map_may_be_a_small_file() -> None:
    rows, blank = ["." * 1500] * 1500, picture(["_" * 1500] * 1500, greys={"_": 255})
    drawn = {"rows": rows, "resolution_m": 0.5, "mask": {"image": blank, "greys": {"floor": 255}}}
    assert read(map=drawn).grid.cells.size == 1500 * 1500
    with pytest.raises(InputError, match="more than the limit of 2125000 for a compressed file"):
        read(map={"resolution_m": 0.5, "image": blank})


def test_a_pose_in_metres_is_a_cell_in_a_turned_frame() -> None:
    turned = {**map_state()["map"], "origin_m": [10, 5, np.pi / 2]}
    robots = [{"name": "c", "type": "carrier", "pose_m": [10 - 0.75, 5 + 1.25]}]
    assert read(map=turned, robots=robots).robots[0].cell == Cell(2, 1)


def test_a_docking_keeps_both_busy_and_an_undocking_too() -> None:
    dock = {"name": "r", "type": "rover", "carrier": "c", "action": {"name": "dock", "remaining_s": 1.5}}
    undock = {"name": "u", "type": "rover", "cell": [2, 1]}
    undock["action"] = {"name": "undock", "carrier": "c", "remaining_s": 2}
    drive = {"name": "d", "type": "rover", "cell": [3, 1], "action": {"name": "drive", "remaining_s": 0.25}}
    state = read(robots=[map_state()["robots"][0], dock, undock, drive])
    busy = {robot.name: (robot.free_at_ms, robot.carrier) for robot in state.robots}
    assert busy == {"c": (2000, None), "r": (1500, "c"), "u": (2000, None), "d": (250, None)}
    situation = state.situation()
    assert situation.robot_by_name["c"].free_at_ms == 2000
    assert situation.robot_by_name["u"].place == "s_u"


def test_the_goal_is_what_was_sent() -> None:
    robots = [{"name": "c", "type": "carrier", "cell": [1, 1], "home_cell": [2, 2]}, map_state()["robots"][1]]
    situation = read(robots=robots, goal={"return_home": True}).situation()
    assert (situation.targets != (), situation.goal.return_home, situation.goal.recover_rovers) == (True, True, False)
    assert situation.homes == ("h_c",)


def seated(**seats: int) -> list[dict[str, Any]]:
    """Return the robot types, the carrier's with seats and without capacity."""
    carrier, rover = map_state()["robot_types"]
    del carrier["capacity"]
    return [{**carrier, "seats": seats}, rover]


def test_seats_of_a_map_state_are_those_of_its_situation() -> None:
    (carrier, _) = read(robot_types=seated(rover=2)).situation().types
    assert (carrier.capacity, carrier.seats) == (2, (("rover", 2),))


CARRIER = map_state()["robots"][0]
WIDE = {**map_state()["robot_types"][0], "radius_m": 0.3}


@pytest.mark.parametrize(
    ("changes", "name", "text"),
    [
        ({"robots": [{**CARRIER, "cell": [9, 9]}]}, "/robots/0/cell", "outside the map"),
        ({"robots": [{**CARRIER, "cell": [0, 0]}]}, "/robots/0/cell", "the cell is obstacle"),
        ({"robots": [{**CARRIER, "type": "robot"}]}, "/robots/0/type", "unknown robot type"),
        ({"robots": [CARRIER, {"name": "r", "type": "rover", "carrier": "x"}]}, "/robots/1/carrier", "unknown carrier"),
        ({"robot_types": seated(rover=0)}, "/robots/1/carrier", "type 'rover' does not fit on type 'carrier'"),
        ({"robot_types": seated(rovr=1)}, "/robot_types/0/seats/rovr", "unknown robot type 'rovr'"),
        ({"robot_types": seated(carrier=1)}, "/robot_types/0/seats/carrier", "is a carrier"),
        ({"robot_types": seated()}, "/robot_types/0/seats", "must name a rover type"),
        ({"robots": [{**CARRIER, "pose_m": [11, 6]}]}, "/robots/0", "needs one of"),
        ({"robots": [CARRIER], "goal": {"return_home": True}}, "/robots/0/home_m", "missing"),
        ({"robots": [{**CARRIER, "action": {"name": "dock", "remaining_s": 1}}]}, "/robots/0/action/name", "rovers"),
        ({"map": {"rows": ROWS, "resolution_m": 0.001}, "robot_types": [WIDE]}, "/robot_types/0/radius_m", "200 cells"),
        ({"map": {"image": "AAAA", "resolution_m": 1}}, "/map/image", "is not a PNG or PGM image"),
        ({"map": {"image": "AAAAA", "resolution_m": 1}}, "/map/image", "is not base64"),
        ({"map": {"nav2": {"yaml": "a: [", "image": picture(ROWS)}}}, "/map/nav2/yaml", "is not valid YAML"),
        ({"terrains": [{"name": "floor"}]}, "/terrains/0/name", "used twice"),
        (
            {"meetings": [{"name": "m", "carrier_cell": [9, 9], "rover_cell": [1, 1], "carrier_type": "carrier",
                           "rover_type": "rover"}]},
            "/meetings/0/carrier_cell",
            "outside the map",
        ),
    ],
)  # fmt: skip
def test_errors_have_pointers(changes: dict[str, Any], name: str, text: str) -> None:
    found = refusal(**changes)
    assert text in found["/map_state" + name]


def bomb(width: int, height: int) -> str:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 1000))
    return base64.b64encode(data).decode()


def test_a_map_beyond_the_limit_is_refused_before_it_is_decoded(http: httpx.Client) -> None:
    for given in ({"image": bomb(100_000, 100_000), "resolution_m": 1}, {"rows": ["." * 101] * 100, "resolution_m": 1}):
        answer = http.post("/v1/analysis", json={"map_state": map_state(map=given)})
        field = "image" if "image" in given else "rows"
        assert pointers(problem(answer, 413, "too-large")) == [f"/map_state/map/{field}"]


def test_an_analysis_is_in_the_frame_of_the_map(http: httpx.Client) -> None:
    state = {**DEMOS["yard"].load()}
    state["map"] = {**state["map"], "origin_m": [10, 5, np.pi / 2]}
    state["robots"][0] = {"name": "mother", "type": "carrier", "cell": [3, 2]}
    found = http.post("/v1/analysis", json={"map_state": state}).json()
    features = {feature["id"]: feature for feature in found["features"]}
    start = features["s_mother/carrier"]
    assert start["geometry"] == {"type": "Point", "coordinates": [8.75, 6.75]}
    assert start["properties"] == {"what": "start", "name": "mother", "robot_type": "carrier", "cell": [3, 2]} | {
        "name": "s_mother"
    }
    area = features["reach/rover"]["properties"]["area_m2"]
    rings = features["reach/rover"]["geometry"]["coordinates"]
    assert sum(shoelace(ring) for polygon in rings for ring in polygon) == pytest.approx(area)
    costs = [f for f in found["features"] if f["properties"]["what"] == "cost"]
    travel, places = found["situation"]["travel_ms"], found["situation"]["places"]
    for cost in costs:
        told = cost["properties"]
        row, column = places.index(told["origin"]), places.index(told["place"])
        assert travel[told["robot_type"]][row][column] == told["travel_ms"]
    only = http.post("/v1/analysis", json={"map_state": state, "include": ["reach"]}).json()
    assert {feature["properties"]["what"] for feature in only["features"]} == {"reach"}


def test_an_analysis_warns_of_free_cells_on_the_edge_of_the_map(http: httpx.Client) -> None:
    state = DEMOS["yard"].load()
    assert http.post("/v1/analysis", json={"map_state": state}).json()["warnings"] == []
    rows = ["############", *["............"] * 3, "############"]
    robot = {"name": "mother", "type": "carrier", "cell": [3, 2]}
    corridor = {**state, "map": {"rows": rows, "resolution_m": 0.5}, "robots": [robot]}
    answer = http.post("/v1/analysis", json={"map_state": corridor}).json()
    (warning,) = answer["warnings"]
    assert "6 of the cells on it are free" in warning
    assert "the edge counts as the end of the world" in warning


def shoelace(ring: list[list[float]]) -> float:
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise(ring)) / 2


def test_a_map_state_has_batteries_charges_and_charging_places() -> None:
    carrier, rover = map_state()["robot_types"]
    rover = {**rover, "energy": {"idle_w": 4, "drive_w": 8}, "battery": {"capacity_j": 900, "charge_w": 30}}
    robots = [map_state()["robots"][0], {**map_state()["robots"][1], "charge": 0.5}]
    given = {"robot_types": [carrier, rover], "robots": robots, "chargers": [{"at_m": [11.2, 5.6]}, {"cell": [3, 2]}]}
    situation = read(**given).situation()
    assert situation.chargers == ("charge_2_1", "charge_3_2")
    assert situation.robot_by_name["r"].charge_j == 450
    assert refusal(**{**given, "robot_types": [carrier, map_state()["robot_types"][1]]}) == {
        "/map_state/robots/1/charge": "a rover has no battery\n"
    }
    assert refusal(chargers=[{"cell": [0, 0]}]) == {"/map_state/chargers/0/cell": "is an obstacle\n"}
    assert list(refusal(chargers=[{"cell": [1, 1], "at_m": [1, 1]}, {}])) == [
        "/map_state/chargers/0",
        "/map_state/chargers/1",
    ]


def test_a_map_state_in_a_job_becomes_the_situation_for_the_planner(http: httpx.Client) -> None:
    body = {"map_state": map_state(), "planner": "greedy"}
    job = http.post(
        "/v1/jobs", content=json.dumps(body), headers={"content-type": "application/json", "Prefer": f"wait={HANG_S:g}"}
    )
    asked = http.get(job.json()["links"]["situation"]).json()["situation"]
    assert asked == http.post("/v1/analysis", json={"map_state": map_state()}).json()["situation"]
