"""Foxglove's messages for the parts of a mission: numbers and words of marsupial in, protobuf messages out.

All coordinates are metres in the frame ``map``, in which the map's origin is given. Each robot has a frame of its own
with the robot's name.
"""

from collections.abc import Iterable, Sequence
from math import cos, pi, sin

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.Grid_pb2 import Grid as GridMessage
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from marsupial.model import CellArray, Grid, Role
from marsupial.replay.palette import Palette

MAP_FRAME = "map"

# The fields of a grid, a byte each: viewers take fields of these names as the colour of a cell.
CHANNELS = ("red", "green", "blue", "alpha")

LINE_HEIGHT_M, LABEL_HEIGHT_M = 0.02, 0.6  # height of lines and texts, above the ground so that it does not hide them

LABEL_POINTS = 13.0


def stamp(t_ms: int) -> Timestamp:
    """Return the time stamp of a moment: missions start at the epoch, so that the same mission has the same bytes."""
    return Timestamp(seconds=t_ms // 1000, nanos=t_ms % 1000 * 1_000_000)


def colour(text: str, alpha: float = 1.0) -> Color:
    """Return the colour ``#rrggbb``, whose parts are 0 to 1 here."""
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return Color(r=red, g=green, b=blue, a=alpha)


def pose(x_m: float, y_m: float, yaw: float = 0.0, z_m: float = 0.0) -> Pose:
    """Return a pose on the plane; `yaw` in radians."""
    rotation = Quaternion(z=sin(yaw / 2), w=cos(yaw / 2))
    return Pose(position=Vector3(x=x_m, y=y_m, z=z_m), orientation=rotation)


def grid_message(grid: Grid, cells: CellArray, corner: tuple[int, int], palette: Palette, t_ms: int) -> GridMessage:
    """Return the part `cells` (height, width) of a map, whose lower left cell is at `corner`, as coloured cells."""
    # A table from terrain codes to colours: one look-up for the whole grid.
    table = np.zeros((256, 4), dtype=np.uint8)
    for code in np.unique(cells):
        table[code] = (*bytes.fromhex(palette.ground(int(code))[1:]), 255)
    byte = PackedElementField.NumericType.UINT8
    fields = [PackedElementField(name=name, offset=offset, type=byte) for offset, name in enumerate(CHANNELS)]
    return GridMessage(
        timestamp=stamp(t_ms),
        frame_id=MAP_FRAME,
        pose=pose(*grid.point_m(*corner), grid.origin_m[2]),
        column_count=cells.shape[1],
        cell_size=Vector2(x=grid.resolution_m, y=grid.resolution_m),
        row_stride=cells.shape[1] * len(CHANNELS),
        cell_stride=len(CHANNELS),
        fields=fields,
        data=table[cells].tobytes(),
    )


def scene(t_ms: int, entities: Iterable[SceneEntity]) -> SceneUpdate:
    """Return an update that replaces everything on its topic."""
    everything = SceneEntityDeletion(timestamp=stamp(t_ms), type=SceneEntityDeletion.Type.ALL)
    return SceneUpdate(deletions=[everything], entities=entities)


def robot_entity(
    t_ms: int, name: str, role: Role, radius_m: float, ink: str, label: str, *, height_m: float = 0.0
) -> SceneEntity:
    """Return a robot that moves with the frame `name`: a disc for a carrier, a square on its corner for a rover."""
    # `height_m` is the height of its underside: a rover aboard stands on its carrier.
    size = Vector3(x=2 * radius_m, y=2 * radius_m, z=radius_m)
    middle = height_m + radius_m / 2
    text = _text(label, pose(0, 0, z_m=height_m + LABEL_HEIGHT_M + radius_m), ink)
    entity = SceneEntity(timestamp=stamp(t_ms), frame_id=name, id=name, frame_locked=True, texts=[text])
    if role is Role.CARRIER:
        body = CylinderPrimitive(pose=pose(0, 0, z_m=middle), size=size, bottom_scale=1, top_scale=1, color=colour(ink))
        entity.cylinders.append(body)
    else:
        entity.cubes.append(CubePrimitive(pose=pose(0, 0, pi / 4, middle), size=size, color=colour(ink)))
    return entity


def line_entity(
    t_ms: int, name: str, points: Sequence[tuple[float, float]], ink: str, *, thick_m: float, alpha: float = 1.0
) -> SceneEntity:
    """Return a line on the ground through points in metres."""
    line = LinePrimitive(
        type=LinePrimitive.Type.LINE_STRIP,
        pose=pose(0, 0),
        thickness=thick_m,
        points=[Point3(x=x, y=y, z=LINE_HEIGHT_M) for x, y in points],
        color=colour(ink, alpha),
    )
    return SceneEntity(timestamp=stamp(t_ms), frame_id=MAP_FRAME, id=name, lines=[line])


def place_entity(
    t_ms: int, name: str, at: tuple[float, float], fill: str, *, radius_m: float, label: str = "", ink: str = "#000000"
) -> SceneEntity:
    """Return a flat disc on the ground, with a label above it."""
    disc = CylinderPrimitive(
        pose=pose(*at, z_m=LINE_HEIGHT_M),
        size=Vector3(x=2 * radius_m, y=2 * radius_m, z=LINE_HEIGHT_M),
        bottom_scale=1,
        top_scale=1,
        color=colour(fill),
    )
    entity = SceneEntity(timestamp=stamp(t_ms), frame_id=MAP_FRAME, id=name, cylinders=[disc])
    if label:
        entity.texts.append(_text(label, pose(*at, z_m=LABEL_HEIGHT_M), ink))
    return entity


def _text(label: str, at: Pose, ink: str) -> TextPrimitive:
    """Return a label that faces the viewer and keeps its size on the screen."""
    return TextPrimitive(
        pose=at, billboard=True, font_size=LABEL_POINTS, scale_invariant=True, color=colour(ink), text=label
    )
