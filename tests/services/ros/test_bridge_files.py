"""The settings of the bridge, its state file, and the files of its interfaces."""

import asyncio
import json
import re
from pathlib import Path

import pytest

pytest.importorskip("websockets")

from ros_parts import FleetBench, settings_of

from marsupial.cli.main import main
from marsupial.errors import InputError, ScenarioError, UsageError
from marsupial_client import AsyncClient
from marsupial_ros.bridge import Bridge
from marsupial_ros.journal import Journal, Record
from marsupial_ros.rosbridge import Rosbridge
from marsupial_ros.settings import read_settings

FRAME = {"width": 1, "height": 1, "resolution_m": 1.0, "origin_m": [0.0, 0.0, 0.0]}


def test_the_settings_of_the_documentation_can_be_read(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "ros.md").read_text()
    whole, _ = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "fleet.yaml").write_text(whole)
    settings = read_settings(tmp_path / "fleet.yaml")
    assert [robot.namespace for robot in settings.robots] == ["/carrier1", "/fleet/c2", "/rover1", "/rover2"]
    short = re.sub(r"^(map|planning|waits|goal|rosbridge|name):.*\n(  .*\n)*", "", whole, flags=re.MULTILINE)
    (tmp_path / "fleet.yaml").write_text(short)
    usual = read_settings(tmp_path / "fleet.yaml")
    assert (usual.map.topic, usual.waits, usual.goal) == (settings.map.topic, settings.waits, settings.goal)


def test_the_first_hour_of_the_documentation_fits_itself(tmp_path: Path) -> None:
    text = (Path(__file__).parents[3] / "docs" / "ros-first-hour.md").read_text()
    slam, fleet = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    (tmp_path / "fleet.yaml").write_text(fleet)
    settings = read_settings(tmp_path / "fleet.yaml")
    names = re.findall(r"robot\.launch\.py name:=(\w+)", text)
    assert [(one.name, one.namespace, one.tf) for one in settings.robots] == [(n, f"/{n}", f"/{n}/tf") for n in names]
    assert list(settings.map.topics) == [f"/{name}/map" for name in names]
    assert f"map_frame: {settings.map.frame}\n" in slam


def test_errors_in_settings_are_reported_by_field(tmp_path: Path) -> None:
    more = {
        "map": "{tpic: /map, free_thresh: 0.7}",
        "controller": "{goal_checker_id: 3}",
        "goal": "{recover_rovers: perhaps}",
    }
    extra = "  - {name: c2, type: carrier, base_frame: carrier1/base_link, namespace: c2, drive: fly}\n"
    path = tmp_path / "fleet.yaml"
    with pytest.raises(ScenarioError):
        settings_of(tmp_path, more)
    text = path.read_text().replace("waits: {", extra + "waits: {").replace("ws://", "http://")
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        read_settings(path)
    lines = {re.sub(r"^line \d+: ", "", line.removeprefix(f"{path}: ")) for line in str(caught.value).splitlines()}
    assert lines == {
        "rosbridge: must be like ws://127.0.0.1:9090, got 'http://127.0.0.1:1'",
        "map.free_thresh: must be below occupied_thresh (0.65)",
        "map.tpic: unknown field, did you mean 'topic'?; the fields here are topic, updates, topics, frame, "
        "free_thresh, occupied_thresh, compression, keepout, speed",
        "controller.goal_checker_id: must be a text, got 3",
        "goal.recover_rovers: must be true or false, got 'perhaps'",
        "robots[2].namespace: must begin with '/', got 'c2'",
        "robots[2].drive: must be follow_path or navigate_to_pose, got 'fly'",
        "robots[2].base_frame: 'carrier1/base_link' of /tf is also that of carrier1",
    }


def test_a_state_reads_back_unchanged(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "state")
    assert journal.read() is None
    record = Record(mission="m", frame=FRAME, after=3, aboard={"a": "b"}, report={"n": 1, "t_ms": 2})
    journal.write(record)
    assert journal.read() == record
    journal.forget()
    assert journal.read() is None


STATE = json.dumps({"version": 1, "mission": "m", "frame": FRAME})


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{}",
        "[]",
        '{"version": 9}',
        '{"version": 1, "other": 2}',
        "[" * 100_000,
        STATE[:-10],
        STATE.replace('"m"', "7"),
        STATE.replace('"width": 1', '"width": 1e99'),
        STATE.replace('"width": 1', '"width": -1'),
        STATE.replace('"origin_m": [0.0, ', '"origin_m": ['),
        STATE.replace("}}", '}, "active_commands": [{}]}'),
        STATE.replace("}}", '}, "aboard": 3}'),
    ],
)
def test_an_invalid_state_file_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "state").write_text(text)
    with pytest.raises(InputError, match="is not a state file of `marsupial ros`"):
        Journal(tmp_path / "state").read()


def test_an_unwritable_state_file_is_reported_before_a_mission_begins(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="can't be written"):
        Journal(tmp_path / "missing" / "state").read()


def test_a_state_of_other_robots_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "state")
    journal.write(Record(mission="m", frame=FRAME, aboard={"rover9": "carrier9"}, lost=["carrier1"]))
    bridge = Bridge(
        settings_of(tmp_path),
        Rosbridge("ws://127.0.0.1:1", []),
        AsyncClient("http://127.0.0.1:1"),
        journal,
        print,
        lambda: 0,
    )
    with pytest.raises(InputError, match="belongs to a mission with other robots: rover9"):
        asyncio.run(bridge.run())


def test_settings_are_checked_without_ros(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings_of(tmp_path)
    assert main(["ros", str(tmp_path / "fleet.yaml"), "--check"]) == 0
    assert "2 robots, map on /map, rosbridge at ws://127.0.0.1:1" in capsys.readouterr().err
    (tmp_path / "fleet.yaml").write_text("format: marsupial-ros\nversion: 1\n")
    assert main(["ros", str(tmp_path / "fleet.yaml"), "--check"]) == 3
    assert "robot_types: missing" in capsys.readouterr().err


def test_the_interfaces_of_docking_have_the_fields_that_goals_have(bench: FleetBench) -> None:
    bench.command(2, "undock", robot="rover1", carrier="carrier1", cell=[3, 2], point_m=[3.5, 2.5])
    folder = Path(__file__).parents[3] / "services/marsupial_ros/marsupial_interfaces/action"
    for name in ("Dock", "Undock"):
        goal, result, _ = (folder / f"{name}.action").read_text().split("---\n")
        fields = [[line.split()[1] for line in part.splitlines() if line and line[0] != "#"] for part in (goal, result)]
        assert fields == [list(bench.actions.sent[-1][2]), ["success", "message"]]
