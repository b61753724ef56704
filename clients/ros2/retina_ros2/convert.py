"""From ROS to the service and back: metres and newtons here (REP 103), millimetres and millinewtons there.

Both frames are right-handed and both quaternions are x, y, z, w, so axes stay as they are: the frame `retina` is the scene's frame, its origin on
the inner retinal surface and +z out of the tissue. The needle points along the −z of its pose. Nothing here needs ROS.
"""

from __future__ import annotations

import math
import struct
from typing import Iterable, List, NamedTuple, Sequence, Tuple

MM_PER_M = 1000.0
MN_PER_N = 1000.0

# A quaternion may be so far from length 1; it is then made 1. Beyond it the pose is not a pose.
QUATERNION_TOLERANCE = 1e-3


class Field(NamedTuple):
    """A field of a point in a cloud, FLOAT32."""

    name: str
    offset: int


FIELDS: Tuple[Field, ...] = tuple(
    Field(name, 4 * place)
    for place, name in enumerate(("x", "y", "z", "normal_x", "normal_y", "normal_z", "displacement"))
)
POINT_STEP = 4 * len(FIELDS)


def mm(metres: Iterable[float]) -> List[float]:
    """Lengths in mm."""
    return [MM_PER_M * length for length in metres]


def metres(millimetres: Iterable[float]) -> List[float]:
    """Lengths in m."""
    return [length / MM_PER_M for length in millimetres]


def mn(newtons: Iterable[float]) -> List[float]:
    """Forces in mN."""
    return [MN_PER_N * force for force in newtons]


def newtons(millinewtons: Iterable[float]) -> List[float]:
    """Forces in N."""
    return [force / MN_PER_N for force in millinewtons]


def orientation(xyzw: Sequence[float]) -> List[float]:
    """A quaternion of length 1."""
    length = math.sqrt(sum(part * part for part in xyzw))
    if not abs(length - 1.0) <= QUATERNION_TOLERANCE:
        raise ValueError(f"the orientation {list(xyzw)} has the length {length}, and a rotation has 1")
    return [part / length for part in xyzw]


def finite(name: str, numbers: Sequence[float]) -> Sequence[float]:
    """The numbers, if all of them are."""
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"{name} is {list(numbers)}, and must be finite")
    return numbers


def cloud(
    vertices_mm: Sequence[Sequence[float]], normals: Sequence[Sequence[float]], displacement_um: Sequence[float]
) -> bytes:
    """The data of a PointCloud2 with `FIELDS`, little-endian: positions and displacements in m."""
    rows = zip(vertices_mm, normals, displacement_um)
    return b"".join(struct.pack("<7f", *metres(vertex), *normal, 1e-6 * moved) for vertex, normal, moved in rows)


def triangle_list(vertices_mm: Sequence[Sequence[float]], triangles: Sequence[Sequence[int]]) -> List[List[float]]:
    """The corners of a TRIANGLE_LIST marker, three for each triangle, in m."""
    vertices = [metres(vertex) for vertex in vertices_mm]
    return [vertices[corner] for triangle in triangles for corner in triangle]
