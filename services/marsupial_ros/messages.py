"""Convert ROS messages, as rosbridge carries them in JSON or CBOR, to values and back.

References: `nav_msgs`, `map_msgs`, `tf2_msgs`, `geometry_msgs`, `rosgraph_msgs`, `sensor_msgs`, `nav2_msgs` of ROS 2;
typed arrays in CBOR are those of RFC 8746.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from marsupial.errors import MapError
from marsupial.formats.mapfiles.occupancy import (
    Occupancy,
    OccupancyArray,
    OccupancyUpdate,
    shortest_resolution,
    unit_rotation,
    yaw_and_tilt,
)
from marsupial.model.bounds import BOUNDS
from marsupial_ros.transforms import Transform

MAP_TYPE = "nav_msgs/msg/OccupancyGrid"
UPDATE_TYPE = "map_msgs/msg/OccupancyGridUpdate"
TF_TYPE = "tf2_msgs/msg/TFMessage"
CLOCK_TYPE = "rosgraph_msgs/msg/Clock"
SPEED_TYPE = "nav2_msgs/msg/SpeedLimit"
BATTERY_TYPE = "sensor_msgs/msg/BatteryState"

# tag of an array of signed bytes in CBOR (RFC 8746)
_INT8_ARRAY = 72
# errors raised when a message doesn't match its type
UNREADABLE = (KeyError, TypeError, ValueError, AttributeError, OverflowError, MapError)


def occupancy_in(message: Mapping[str, Any]) -> Occupancy:
    """Return the map in a `nav_msgs/OccupancyGrid`."""
    info = message["info"]
    pose = info["origin"]
    origin = transform_of(pose["position"], pose["orientation"])
    yaw, tilt = yaw_and_tilt(*origin.rotation)
    return Occupancy(
        values=_values(message["data"], info["width"], info["height"]),
        resolution_m=shortest_resolution(info["resolution"]),
        origin_m=(*origin.point, yaw),
        tilt=tilt,
    )


def update_in(message: Mapping[str, Any]) -> OccupancyUpdate:
    """Return the part of a map in a `map_msgs/OccupancyGridUpdate`."""
    values = _values(message["data"], message["width"], message["height"])
    return OccupancyUpdate(int(message["x"]), int(message["y"]), values)


def check_frame(message: Mapping[str, Any], frame: str) -> None:
    """Check that a message is in a frame, or names none. Raises MapError if it is in another frame."""
    found = frame_in(message)
    if found not in ("", frame):
        raise MapError(f"must be in the frame {frame!r}, got {found!r}")


def frame_in(message: Mapping[str, Any]) -> str:
    """Return the frame of a message; empty if it names none."""
    return str(message.get("header", {}).get("frame_id", "")).lstrip("/")


def stamp_in(message: Mapping[str, Any]) -> float:
    """Return the stamp of a message in seconds; 0 if it has none."""
    header = message.get("header", {})
    return seconds_of(header["stamp"]) if "stamp" in header else 0.0


def link_in(stamped: Mapping[str, Any]) -> tuple[str, str, Transform, float]:
    """Return parent and child frame of a `geometry_msgs/TransformStamped`, its transform and stamp (s; 0: none)."""
    header, parts = stamped["header"], stamped["transform"]
    transform = transform_of(parts["translation"], parts["rotation"])
    return header["frame_id"].lstrip("/"), stamped["child_frame_id"].lstrip("/"), transform, stamp_in(stamped)


def speed_share_in(message: Mapping[str, Any], speed_mps: float) -> float:
    """Return the share of a robot's full speed that a `nav2_msgs/SpeedLimit` allows; a limit of 0 is none."""
    limit = float(message["speed_limit"])
    if not 0 <= limit < math.inf:
        raise ValueError(f"a speed limit of {limit}")
    share = limit / 100 if message["percentage"] else limit / speed_mps
    return min(1.0, max(BOUNDS["speed_share"].least, round(share, 2))) if limit else 1.0


def charge_in(message: Mapping[str, Any]) -> float | None:
    """Return the charge in a `sensor_msgs/BatteryState`, from 0 to 1; None if it is unknown."""
    # unknown is NaN, which is null in JSON; or negative: MAVROS divides MAVLink's -1 by 100
    share = message["percentage"]
    if share is None or math.isnan(float(share)) or float(share) < 0:
        return None
    # in single precision; some drivers send a little more than 1
    if float(share) > 1.05:
        raise ValueError(f"a percentage of {float(share):g}, which must be from 0 to 1")
    return min(1.0, round(float(share), 4))


def seconds_of(time: Mapping[str, Any]) -> float:
    """Return a `builtin_interfaces/Time` in seconds."""
    seconds = float(time["sec"]) + float(time["nanosec"]) / 1e9
    if not math.isfinite(seconds):
        raise ValueError(f"the time {seconds} is not finite")
    return seconds


def transform_of(translation: Mapping[str, float], rotation: Mapping[str, float]) -> Transform:
    """Return a transform from its vector and its quaternion."""
    turned = unit_rotation(float(rotation["x"]), float(rotation["y"]), float(rotation["z"]), float(rotation["w"]))
    vector = tuple(float(translation[key]) for key in "xyz")
    if not all(map(math.isfinite, vector)):
        raise ValueError(f"translation {vector} is not finite")
    return Transform((vector[0], vector[1], vector[2]), turned)


def path_of(route_m: Sequence[Sequence[float]], yaw: float, frame: str) -> dict[str, Any]:
    """Return a route as a `nav_msgs/Path`, each pose facing the next; `yaw` is for a route of one point."""
    return {
        "header": _header(frame),
        "poses": [pose_stamped(point, angle, frame) for point, angle in zip(route_m, _yaws(route_m, yaw), strict=True)],
    }


def pose_stamped(point_m: Sequence[float], yaw: float, frame: str) -> dict[str, Any]:
    """Return a `geometry_msgs/PoseStamped` that is valid at any time."""
    return {
        "header": _header(frame),
        "pose": {
            "position": {"x": float(point_m[0]), "y": float(point_m[1]), "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)},
        },
    }


def final_yaw(route_m: Sequence[Sequence[float]], yaw: float) -> float:
    """Return the yaw of a robot at the end of a route; `yaw` if the route has only one point."""
    return _yaws(route_m, yaw)[-1]


def _yaws(route_m: Sequence[Sequence[float]], yaw: float) -> list[float]:
    yaws = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(route_m)]
    return [*yaws, yaws[-1] if yaws else yaw]


def _header(frame: str) -> dict[str, Any]:
    """Return a header with stamp 0, which tf2 takes as the latest transform available."""
    return {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame}


def _values(data: Any, width: int, height: int) -> OccupancyArray:
    """Return the cells of a message: a JSON list, or CBOR bytes or typed array."""
    if getattr(data, "tag", None) == _INT8_ARRAY:
        data = data.value
    values = np.frombuffer(data, np.int8) if isinstance(data, bytes) else np.asarray(data, dtype=np.int8)
    if values.ndim != 1 or len(values) != width * height:
        raise ValueError(f"data must have {width} x {height} cells, got {values.size}")
    return values.reshape(height, width)
