"""Small valid examples of every kind of file that is read: the fuzzer's first inputs."""

from __future__ import annotations

import gzip
import json
import re
import tempfile
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from pathlib import Path

import marsupial
from benchmarks.scenario_files import scenario_text
from marsupial.bench.compare.folder import FILES
from marsupial.formats.pddl.read import read_problem
from marsupial.formats.situation import situation_to_json
from marsupial.generators.builtin import builtin_scenario
from marsupial.model.situation import Situation

ROOT = Path(__file__).parents[2]


@cache
def deploy() -> Situation:
    """Return the situation of an example in PDDL."""
    return read_problem((ROOT / "pddl/examples/deploy/problem.pddl").read_text())


def of(pattern: str) -> Callable[[], list[bytes]]:
    """Return a function that reads the project's files that match a pattern."""
    return lambda: [path.read_bytes() for path in sorted(ROOT.glob(pattern))]


def headers() -> list[bytes]:
    """Return the yaml of a map, with the image of few pixels."""
    return [(ROOT / "docs/tutorial/workshop.yaml").read_bytes().replace(b"workshop.png", b"small.pgm")]


def scenarios() -> list[bytes]:
    """Return the small built-in scenarios, one with every field, and the tutorial's."""
    lobby = scenario_text(builtin_scenario("lobby")).encode()
    team = (ROOT / "docs/tutorial/workshop-team.yaml").read_bytes()
    return [lobby, team, FULL_SCENARIO.encode(), *yaml_blocks("docs/scenario-format.md")]


def yaml_blocks(document: str) -> list[bytes]:
    """Return the blocks of YAML in a document."""
    return re.findall(rb"```yaml\n(.*?)```", (ROOT / document).read_bytes(), re.DOTALL)


FULL_SCENARIO = json.dumps(
    {
        "format": "marsupial-scenario", "version": 1, "name": "yard", "start_seed": 3,
        "terrains": [{"name": "mud", "code": 7, "blocks_sight": False}],
        "map": {"resolution_m": 0.5, "origin_m": [1, 2, 0], "legend": {"m": "mud"},
                "rows": ["#####", "#.m~#", "#####"]},
        "robot_types": [
            {"name": "c", "role": "carrier", "speed_mps": 1, "sensor_range_m": 3, "radius_m": 0.1,
             "terrains": ["floor"], "capacity": 1, "diagonal": 1.2, "routes": "energy",
             "energy": {"idle_w": 1, "drive_w": 2, "metre_j": 3, "stop_j": 4, "turn_j": [0, 1, 2, 3]}},
            {"name": "r", "role": "rover", "speed_mps": 0.5, "sensor_range_m": 2, "radius_m": 0, "dock_s": 2.5,
             "terrains": ["floor", "rough", "mud"], "undock_s": 1},
        ],
        "team": [{"name": "c1", "type": "c", "start": [1.75, 2.75]}, {"name": "r1", "type": "r", "carrier": "c1"}],
        "goal": {"recover_rovers": True, "return_home": True}, "limits": {"time_s": 600, "coverage": 0.9},
        "planning_time": "instant",
        "faults": [
            {"fault": "lost", "robot": "r1", "at_s": 1},
            {"fault": "stuck", "rate_per_h": 2, "role": "rover", "for_s": 3},
            {"fault": "slows", "robot": "c1", "seen_m": [2, 3], "speed_share": 0.5},
            {"fault": "ground", "area_m": [1, 2, 2, 3], "terrain": "mud", "at_s": 2},
            {"fault": "missed_cells", "share": 0.1, "seed": 2},
            {"fault": "position_noise", "share": 0.1, "robot": "r1"},
        ],
    }
)  # fmt: skip


def situations() -> list[bytes]:
    """Return a situation with one target, and one from a mission."""
    moment = files("marsupial.bench.suite") / "moments" / "mission-lobby-1x2-5.json.gz"
    return [situation_to_json(deploy()).encode(), gzip.decompress(moment.read_bytes())]


@cache
def logs() -> list[bytes]:
    """Return short logs: from their beginning, without most of it, with a frame that grew, of another version."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log.jsonl")
        marsupial.explore("lobby", "heuristic", log=log)
        lines = log.read_bytes().splitlines(keepends=True)
    head, ended = lines[0], lines[-1]
    grown = b'{"event":"frame","t_ms":0,"width":400,"height":400,"origin_m":[0,0,0],"shift":[1,2]}\n'
    return [
        b"".join(lines[:8]),
        b"".join((*lines[:4], ended)),
        head + grown,
        head.replace(b'"version":3', b'"version":2') + ended,
    ]


def images() -> list[bytes]:
    """Return a small image of every kind that is read."""
    import io

    from PIL import Image

    found = [b"P2\n2 2\n255\n0 205 254 128\n", b"P5\n# saved\n3 2\n255\n\0\xcd\xfe\0\xcd\xfe"]
    for mode in ("1", "L", "LA", "P", "RGB", "RGBA", "I;16"):
        file = io.BytesIO()
        Image.new(mode, (4, 3)).save(file, "PNG")
        found.append(file.getvalue())
    for kind in ("BMP", "JPEG", "PPM"):
        file = io.BytesIO()
        Image.new("L", (4, 3), 200).save(file, kind)
        found.append(file.getvalue())
    return found


def recordings(suffix: str) -> list[bytes]:
    """Return a recording with one small map."""
    from rosbags import rosbag2, typesys

    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    name, types = "nav_msgs/msg/OccupancyGrid", store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    pose = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=-1.5, y=2.0, z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
    )
    info = types["nav_msgs/msg/MapMetaData"](map_load_time=stamp, resolution=0.05, width=3, height=2, origin=pose)
    import numpy as np

    grid = types[name](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="map"),
        info=info,
        data=np.array([0, 100, -1, 0, 0, 50], dtype=np.int8),
    )
    plugin = {".mcap": rosbag2.StoragePlugin.MCAP, ".db3": rosbag2.StoragePlugin.SQLITE3}[suffix]
    with tempfile.TemporaryDirectory() as folder:
        with rosbag2.Writer(Path(folder, "run"), version=9, storage_plugin=plugin) as writer:
            connection = writer.add_connection("/map", name, typestore=store)
            writer.write(connection, 1, store.serialize_cdr(grid, name))
        return [next(Path(folder, "run").glob(f"*{suffix}")).read_bytes()]


def comparisons() -> list[bytes]:
    """Return the files of a comparison: its head, and lines of each kind."""
    head = {
        "format": "marsupial-comparison", "version": 1, "marsupial": "0.1.0", "paper": None, "made_with": {},
        "contenders": [["temporal", "greedy"]],
        "cases": [{"scenario": "lobby", "carriers": 1, "rovers": 2, "digest": ""}],
        "runs": 3, "budget": {"steps": 8},
    }  # fmt: skip
    key = "lobby,temporal,greedy,1,2,7"
    columns = {name: len(lines.readers) for name, lines in FILES.items()}
    values = {
        "rows.csv": ["complete", "", *["1"] * (columns["rows.csv"] - 2)],
        "timings.csv": ["0.25"] * columns["timings.csv"],
        "coverage.csv": ["5.0", "0 5000 10000"],
    }
    texts = [lines.head + ",".join((key, *values[name])) + "\n" for name, lines in FILES.items()]
    return [json.dumps(head).encode(), *(text.encode() for text in texts)]
