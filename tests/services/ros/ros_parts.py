"""Parts of the bridge for tests without a mission."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ros_rooms import rooms, settings_text, team

from marsupial.formats.mapfiles.masks import FilterMasks
from marsupial.model.grid import TERRAINS
from marsupial_ros.fleet import RobotFleet
from marsupial_ros.map_tracker import MapTracker
from marsupial_ros.messages import occupancy_in
from marsupial_ros.settings import Settings, read_settings
from marsupial_ros.transforms import Frames, Transform


def moved(x: float, y: float, yaw: float = 0.0) -> Transform:
    return Transform((x, y, 0.0), (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def grid_message(rows: list[list[int]], x: float = 0.0, y: float = 0.0, resolution: float = 1.0) -> dict[str, Any]:
    """Return a map, the lowest row first."""
    origin = {"position": {"x": x, "y": y, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    info = {"resolution": resolution, "width": len(rows[0]), "height": len(rows), "origin": origin}
    return {"header": {"frame_id": "map"}, "info": info, "data": [value for row in rows for value in row]}


def tracker_of(*rows: list[int]) -> MapTracker:
    tracker = MapTracker(TERRAINS, FilterMasks(), 0.25, 0.65)
    tracker.take(occupancy_in(grid_message(list(rows))))
    tracker.begin()
    return tracker


class Actions:
    """Records goals and cancel requests."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, str, Mapping[str, Any]]] = []
        self.cancelled: list[str] = []

    def send_goal(self, goal: str, action: str, type: str, values: Mapping[str, Any]) -> None:
        self.sent.append((goal, action, values))

    def cancel_goal(self, goal: str, action: str) -> None:
        self.cancelled.append(goal)


class FleetBench:
    """A fleet of one carrier with a rover aboard, on bare floor."""

    def __init__(self, folder: Path, more: Mapping[str, str] | None = None, extra: str = "") -> None:
        self.settings = settings_of(folder, more, extra)
        self.frames = {"/tf": Frames()}
        self.actions, self.said = Actions(), []
        tracker = tracker_of(*[[0] * 20] * 10)
        self.fleet = RobotFleet(self.settings, self.frames, tracker, self.actions, self.said.append)  # type: ignore[arg-type]
        self.fleet.mission = "m"
        self.at("carrier1", 2.5, 2.5)
        self.fleet.place()

    def at(self, name: str, x: float, y: float, now_s: float = 0.0) -> None:
        self.frames["/tf"].add("map", f"{name}/base_link", moved(x, y), now_s)

    def command(self, id: int, name: str, **more: Any) -> None:
        self.fleet.execute({"id": id, "robot": "carrier1", "name": name, "revision": 1, **more}, 0.0)  # type: ignore[typeddict-item]

    def drive(self) -> None:
        self.command(1, "drive", route=[], route_m=[[x + 0.5, 2.5] for x in range(2, 9)])


def settings_of(folder: Path, more: Mapping[str, str] | None = None, extra: str = "") -> Settings:
    path = folder / "fleet.yaml"
    text = settings_text("ws://127.0.0.1:1", team(rooms(), 1), more).replace("clock: /clock\n", "")
    path.write_text(text + extra)
    return read_settings(path)
