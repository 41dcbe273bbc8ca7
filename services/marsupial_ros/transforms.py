"""Where frames are in other frames: the tree that tf publishes link by link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from marsupial.formats.mapfiles.occupancy import yaw_and_tilt

Point = tuple[float, float]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

# most links between a robot and the map: a tree has no cycles, but messages may have
_LONGEST_CHAIN = 100


class Transform(NamedTuple):
    """A translation in metres, and a rotation as a quaternion (x, y, z, w) of length 1."""

    translation: Vector
    rotation: Quaternion

    @property
    def point(self) -> Point:
        """Metres along x and y."""
        return self.translation[:2]

    @property
    def yaw(self) -> float:
        """Angle about z in radians."""
        return yaw_and_tilt(*self.rotation)[0]

    def of(self, inner: Transform) -> Transform:
        """Return `inner`, a transform into this frame, as a transform into this frame's parent."""
        dx, dy, dz = _rotated(self.rotation, inner.translation)
        x, y, z = self.translation
        return Transform((x + dx, y + dy, z + dz), _product(self.rotation, inner.rotation))


@dataclass(frozen=True, slots=True)
class LastTransform:
    """The last transform of a frame into its parent, and its time (s; None: static); `stamp_s` is by any clock."""

    parent: str
    transform: Transform
    at_s: float | None
    stamp_s: float


class Frames:
    """The frames published on one pair of topics (``/tf``, ``/tf_static``)."""

    def __init__(self) -> None:
        self._links: dict[str, LastTransform] = {}

    def add(self, parent: str, child: str, transform: Transform, at_s: float | None, stamp_s: float = 0.0) -> None:
        """Store a link; `at_s` is None for a static one."""
        # a link with the stamp of the one before is that one, sent again: so a robot whose transforms are repeated
        # grows silent, whatever the clocks of two machines say
        before = self._links.get(child)
        if before is not None and stamp_s and before.stamp_s == stamp_s and before.at_s is not None:
            return
        self._links[child] = LastTransform(parent, transform, at_s, stamp_s)

    def gap(self, frame: str, ancestor: str) -> str | None:
        """Return the frame whose transform is missing between a frame and an ancestor; None if they are connected."""
        for _ in range(_LONGEST_CHAIN):
            if frame == ancestor:
                return None
            link = self._links.get(frame)
            if link is None:
                break
            frame = link.parent
        return frame

    def find(self, frame: str, ancestor: str) -> tuple[Transform, float | None] | None:
        """Return the transform of a frame into another, and its time; None if they are not connected."""
        # the time of the oldest link that is not static, as with tf2: a robot is late if its odometry or its
        # localisation is
        found, at_s = Transform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), None
        for _ in range(_LONGEST_CHAIN):
            if frame == ancestor:
                return found, at_s
            link = self._links.get(frame)
            if link is None:
                return None
            found = link.transform.of(found)
            if link.at_s is not None:
                at_s = link.at_s if at_s is None else min(at_s, link.at_s)
            frame = link.parent
        return None


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _rotated(rotation: Quaternion, vector: Vector) -> Vector:
    x, y, z, w = rotation
    turned = _product(_product(rotation, (*vector, 0.0)), (-x, -y, -z, w))
    return turned[:3]
