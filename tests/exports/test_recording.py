import io
import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import cos, pi, sin
from typing import Any, NamedTuple

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from support.missions.growing_mission import growing_mission
from support.missions.synthetic_mission import synthetic_mission

from marsupial.exports.layout import recording_layout
from marsupial.exports.recording import POSE_EVERY_MS, write_recording
from marsupial.mission.playback import Playback
from marsupial.model import UNKNOWN, Changed, Grid, MissionEvent, MissionStarted, Planned, Revealed
from marsupial.replay.palette import LIGHT

EVENTS = synthetic_mission()


def turned(events: Sequence[MissionEvent]) -> tuple[MissionEvent, ...]:
    """Return the mission on a rotated map."""
    first, *rest = events
    assert isinstance(first, MissionStarted)
    return (replace(first, origin_m=(3.0, -1.0, pi / 6)), *rest)


MISSIONS = {"plain": EVENTS, "growing": growing_mission(), "askew": turned(EVENTS)}


class Said(NamedTuple):
    topic: str
    schema: str
    t_ms: float
    message: Any


def recorded(events: Sequence[MissionEvent]) -> bytes:
    out = io.BytesIO()
    write_recording(events, out)
    return out.getvalue()


def read(data: bytes) -> list[Said]:
    """Return all messages in file order, each decoded by its schema in the file."""
    reader = make_reader(io.BytesIO(data), decoder_factories=[DecoderFactory()])
    decode = DecoderFactory()
    found = []
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        if channel.message_encoding == "json":
            value: Any = json.loads(message.data)
            jsonschema.validate(value, json.loads(schema.data))
        else:
            decoder = decode.decoder_for(channel.message_encoding, schema)
            assert decoder is not None
            value = decoder(message.data)
        found.append(Said(channel.topic, schema.name, message.log_time / 1e6, value))
    return found


@pytest.fixture(scope="module", params=MISSIONS)
def mission(request: pytest.FixtureRequest) -> tuple[Playback, list[Said]]:
    events = MISSIONS[request.param]
    return Playback(events), read(recorded(events))


@pytest.fixture(scope="module")
def plain() -> list[Said]:
    return read(recorded(EVENTS))


def test_every_topic_has_a_schema_that_viewers_know(mission: tuple[Playback, list[Said]]) -> None:
    schemas = {said.topic: said.schema for said in mission[1]}
    robots = mission[0].timeline
    assert schemas == {
        "/map": "foxglove.Grid",
        "/tf": "foxglove.FrameTransforms",
        "/robots": "foxglove.SceneUpdate",
        "/trails": "foxglove.SceneUpdate",
        "/plan": "foxglove.SceneUpdate",
        "/log": "foxglove.Log",
        "/progress": "marsupial.Progress",
        **{f"/robots/{name}/pose": "foxglove.PoseInFrame" for name in robots},
        **{f"/robots/{name}/path": "foxglove.PosesInFrame" for name in ("carrier1", "rover1_1")},
    }


def test_charges_have_a_topic_of_their_own(plain: list[Said]) -> None:
    assert "/charges" not in {said.topic for said in plain}
    events = [replace(e, charges=(("carrier1", 0.5),)) if isinstance(e, Planned) else e for e in EVENTS]
    charges = [said for said in read(recorded(events)) if said.topic == "/charges"]
    assert {said.t_ms for said in charges} == {event.t_ms for event in events if isinstance(event, Planned)}
    assert (charges[0].schema, charges[0].message) == ("marsupial.Charges", {"carrier1": 0.5})


def test_times_increase_and_are_those_of_the_mission(mission: tuple[Playback, list[Said]]) -> None:
    playback, said = mission
    times = [one.t_ms for one in said]
    assert times == sorted(times)
    assert (times[0], times[-1]) == (playback.start_ms, playback.end_ms)
    for one in said:
        stamp = getattr(one.message, "timestamp", None)
        if stamp is not None:
            assert stamp.seconds * 1000 + stamp.nanos / 1e6 == one.t_ms


def test_robots_are_where_the_log_has_them_at_every_moment(mission: tuple[Playback, list[Said]]) -> None:
    playback, said = mission
    started = playback.mission
    blank = np.full((1, 1), UNKNOWN, dtype=np.uint8)
    grid = Grid(cells=blank, resolution_m=started.resolution_m, origin_m=started.origin_m)
    frames = {one.t_ms: one.message for one in said if one.topic == "/tf"}
    latest: dict[str, tuple[float, float]] = {}
    for t_ms in [*range(0, playback.end_ms, POSE_EVERY_MS), playback.end_ms]:
        if t_ms in frames:
            latest = {f.child_frame_id: (f.translation.x, f.translation.y) for f in frames[t_ms].transforms}
        for robot in playback.robots_at(t_ms):
            assert latest[robot.name] == pytest.approx(grid.point_m(robot.x + 0.5, robot.y + 0.5))
    for one in said:
        if one.topic.endswith("/pose"):
            at = one.message.pose.position
            name = one.topic.split("/")[2]
            frame = next(f for f in frames[one.t_ms].transforms if f.child_frame_id == name)
            assert (at.x, at.y) == (frame.translation.x, frame.translation.y)


def test_known_poses_stand_in_the_recording(plain: list[Said]) -> None:
    poses = {(one.topic, one.t_ms): one.message.pose for one in plain if one.topic.endswith("/pose")}
    at = poses["/robots/carrier1/pose", 5000].position
    assert (at.x, at.y) == (-1.5 + 26.5 * 0.25, 2.0 + 20.5 * 0.25)
    aboard = poses["/robots/rover1_2/pose", 5000].position
    assert (aboard.x, aboard.y) == (at.x, at.y)
    west = poses["/robots/rover1_1/pose", 14000].orientation
    assert (west.z, west.w) == pytest.approx((sin(pi / 2), cos(pi / 2)))


def test_the_map_is_written_when_it_changes_and_ends_as_the_log_does(mission: tuple[Playback, list[Said]]) -> None:
    playback, said = mission
    grids = [one for one in said if one.topic == "/map"]
    changes = {event.t_ms for event in playback.events if isinstance(event, Revealed | Changed)}
    assert {grid.t_ms for grid in grids} <= changes
    assert all(b.t_ms - a.t_ms >= 1 for a, b in pairwise(grids))
    assert len(grids) <= playback.duration_ms / 1000 + 1
    last = grids[-1].message
    cells = playback.cells_at(playback.end_ms)
    rows, columns = np.nonzero(cells != UNKNOWN)
    shown = cells[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    image = np.frombuffer(last.data, dtype=np.uint8).reshape(-1, last.column_count, 4)
    assert [field.name for field in last.fields] == ["red", "green", "blue", "alpha"]
    assert (last.row_stride, last.cell_stride) == (4 * last.column_count, 4)
    for code in np.unique(shown):
        assert (image[shown == code] == [*bytes.fromhex(LIGHT.ground(int(code))[1:]), 255]).all()


def test_each_drawing_stands_alone_so_that_a_viewer_can_jump(plain: list[Said]) -> None:
    drawn = [one for one in plain if one.schema == "foxglove.SceneUpdate"]
    assert all([deletion.type for deletion in one.message.deletions] == [1] for one in drawn)
    for one in drawn:
        if one.topic == "/robots":
            assert [entity.id for entity in one.message.entities] == ["carrier1", "rover1_1", "rover1_2"]
        ids = [entity.id for entity in one.message.entities]
        assert len(ids) == len(set(ids))


def test_labels_show_actions_of_robots_and_destinations_of_plans(plain: list[Said]) -> None:
    labels = {(one.t_ms, entity.id): entity.texts[0].text for one in plain if one.topic == "/robots"
              for entity in one.message.entities}  # fmt: skip
    assert labels[5001, "carrier1"] == "carrier1: undocks rover1_1"
    assert labels[16005, "rover1_1"] == "rover1_1: docks on carrier1"
    plan = next(one.message for one in plain if one.topic == "/plan")
    texts = [entity.texts[0].text for entity in plan.entities if entity.texts]
    assert texts[0].startswith("target 1: about ")


def test_the_path_ahead_is_recorded_by_its_corners_and_cleared_at_its_end(plain: list[Said]) -> None:
    paths = {(one.topic.split("/")[2], one.t_ms): one.message.poses for one in plain if one.topic.endswith("/path")}
    assert len(paths["carrier1", 0]) == 2
    assert len(paths["carrier1", 5000]) == 0
    assert len(paths["rover1_1", 12503]) == 3


def test_facts_of_the_mission_are_its_metadata() -> None:
    reader = make_reader(io.BytesIO(recorded(EVENTS)))
    (metadata,) = reader.iter_metadata()
    assert metadata.metadata["scenario"] == "two halves"
    assert metadata.metadata["status"] == "stalled"


def panels_in(part: Any) -> set[str]:
    """Return the ids of the panels of a layout or part of it."""
    return {part} if isinstance(part, str) else panels_in(part["first"]) | panels_in(part["second"])


def test_the_layout_shows_topics_that_the_recording_has() -> None:
    events = [replace(e, charges=(("carrier1", 0.5),)) if isinstance(e, Planned) else e for e in EVENTS]
    layout, said = json.loads(recording_layout(events)), read(recorded(events))
    panels = layout["configById"]
    assert panels_in(layout["layout"]) == set(panels)
    topics = {one.topic for one in said}
    shown = {path["value"].split(".")[0] for panel in panels.values() for path in panel.get("paths", ())}
    assert {*panels["3D!map"]["topics"], *shown, panels["RosOut!log"]["topicToRender"]} <= topics
    doings = [path["value"] for path in panels["StateTransitions!doing"]["paths"]]
    assert doings == [f'/progress.doing."{name}"' for name in Playback(EVENTS).timeline]
    assert "Plot!charge" not in json.loads(recording_layout(EVENTS))["configById"]


@pytest.mark.parametrize("mission", MISSIONS.values(), ids=MISSIONS)
def test_the_camera_of_the_layout_looks_at_the_middle_of_the_map(mission: Sequence[MissionEvent]) -> None:
    started = Playback(mission).mission
    camera = json.loads(recording_layout(mission))["configById"]["3D!map"]["cameraState"]
    middle = Grid(
        cells=np.zeros((started.height, started.width), dtype=np.uint8),
        resolution_m=started.resolution_m,
        origin_m=started.origin_m,
    ).point_m(started.width / 2, started.height / 2)
    assert camera["target"][:2] == pytest.approx(middle)


def test_a_mission_that_still_runs_is_recorded_as_far_as_it_is() -> None:
    half = EVENTS[: len(EVENTS) // 2]
    assert {one.topic for one in read(recorded(half))} >= {"/map", "/robots", "/progress"}
    assert json.loads(recording_layout(half))["layout"]
