"""What the node shows of a mission, and what others may ask of it.

Topics: ``~/state`` (text), ``~/plan`` (markers for RViz: each robot's way by the plan and the route it drives now,
targets, meeting points), ``/diagnostics``. Services: ``~/pause``, ``~/resume``, ``~/wind_down``.
"""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from marsupial.errors import UsageError
from marsupial.model.robots import Role
from marsupial_client import AsyncMission
from marsupial_ros.bridge import Bridge
from marsupial_ros.followed_plan import FollowedPlan
from marsupial_ros.native.ros_node import RosNode
from marsupial_ros.robots import TrackedRobot
from marsupial_ros.team import Team
from marsupial_ros.transforms import Point

# pause between looks at the mission
SHOW_S = 1.0

# numbers of `visualization_msgs/Marker`
LINE_STRIP, SPHERE_LIST, CUBE_LIST, DELETE_ALL = 4, 7, 6, 3
WIDTH_M, SIZE_M = 0.05, 0.25

# red, green, blue, opacity from 0 to 1
PLANNED, DRIVEN = (0.5, 0.5, 0.5, 0.6), (0.1, 0.6, 1.0, 1.0)
TARGETS, MEETINGS = (1.0, 0.6, 0.0, 1.0), (0.8, 0.1, 0.8, 1.0)

# levels of `diagnostic_msgs/DiagnosticStatus`
OK, WARN, ERROR = b"\x00", b"\x01", b"\x02"


class MissionDisplay:
    """Shows the mission of a bridge through a node, in the frame of its map."""

    def __init__(self, node: RosNode, bridge: Bridge, frame: str) -> None:
        self._node = node
        self._bridge = bridge
        self._frame = frame
        self._state = node.publisher("~/state", "std_msgs/msg/String")
        self._plan = node.publisher("~/plan", "visualization_msgs/msg/MarkerArray")
        self._diagnostics = node.publisher("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        self._shown = ""
        for name, act in (
            ("pause", AsyncMission.pause),
            ("resume", AsyncMission.resume),
            ("wind_down", AsyncMission.wind_down),
        ):
            node.trigger(f"~/{name}", self._asking(act))

    async def run(self) -> None:
        while True:
            self.show()
            await asyncio.sleep(SHOW_S)

    def show(self) -> None:
        """Publish what is known now."""
        bridge = self._bridge
        if bridge.state != self._shown:
            self._shown = bridge.state
            self._state({"data": bridge.state})
        self._plan({"markers": markers(self._frame, bridge.fleet, bridge.plan, bridge.point_m)})
        status = [_status("mission", OK, bridge.state), *map(status_of, bridge.fleet.robots.values())]
        self._diagnostics({"header": {"stamp": self._node.stamp}, "status": status})

    def _asking(self, act: Callable[[AsyncMission], Any]) -> Callable[[], Any]:
        async def ask() -> str:
            if self._bridge.mission is None:
                raise UsageError("the mission has not begun")
            return f"mission {(await act(self._bridge.mission))['state']}"

        return ask


def markers(
    frame: str, team: Team, plan: FollowedPlan, point_m: Callable[[Sequence[int]], Point]
) -> list[dict[str, Any]]:
    """Return `visualization_msgs/Marker`s of a plan, and of the routes driven now."""
    targets = {name: point_m(cell) for name, cell in plan.targets.items()}
    carriers = {name: point_m(cell) for name, (cell, _) in plan.meetings.items()}
    rovers = {name: point_m(cell) for name, (_, cell) in plan.meetings.items()}
    ways: dict[str, list[Point]] = {name: [at] for name, at in team.points().items()}
    for robot, place in plan.ways:
        at = targets | (rovers if team.robots[robot].settings.kind.role is Role.ROVER else carriers)
        if place in at:
            ways.setdefault(robot, []).append(at[place])
    found = [{"header": {"frame_id": frame}, "action": DELETE_ALL}]
    found += [_marker(frame, f"plan {name}", LINE_STRIP, way, PLANNED) for name, way in ways.items()]
    for active in team.active_commands:
        if active.drives:
            name = f"route {active.command['robot']}"
            found.append(_marker(frame, name, LINE_STRIP, active.route_m[active.passed :], DRIVEN))
    found.append(_marker(frame, "targets", SPHERE_LIST, list(targets.values()), TARGETS))
    found.append(_marker(frame, "meeting points", CUBE_LIST, list(carriers.values()), MEETINGS))
    return [one for one in found if one["action"] == DELETE_ALL or one["points"]]


def _marker(
    frame: str, name: str, type: int, points: Sequence[Point], colour: tuple[float, float, float, float]
) -> dict[str, Any]:
    size = WIDTH_M if type == LINE_STRIP else SIZE_M
    return {
        "header": {"frame_id": frame},
        "ns": name,
        "type": type,
        "action": 0,
        "pose": {"orientation": {"w": 1.0}},
        "scale": dict.fromkeys("xyz", size),
        "color": dict(zip("rgba", colour, strict=True)),
        "points": [{"x": x, "y": y} for x, y in points] if type != LINE_STRIP or len(points) > 1 else [],
    }


def status_of(robot: TrackedRobot) -> dict[str, Any]:
    """Return the `diagnostic_msgs/DiagnosticStatus` of a robot."""
    faults = {
        "lost": robot.lost,
        "out of contact": robot.away_s is not None,
        "no new transforms": robot.silent,
        "accepts no goals": robot.refusing,
        "somebody else leads it": robot.taken is not None,
    }
    fault = next((text for text, found in faults.items() if found), None)
    doing = "idle" if robot.active is None else robot.active.command["name"]
    level = OK if fault is None else ERROR if robot.lost else WARN
    return _status(robot.name, level, fault or doing)


def _status(name: str, level: bytes, text: str) -> dict[str, Any]:
    return {"name": f"marsupial: {name}", "level": level, "message": text}
