"""The binary messages of a stream, as `server/src/stream/binary.rs` documents them: little-endian, 32-bit numbers."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

_HEADER = struct.Struct("<4sBBHQd")
_POSE = struct.Struct("<3f4f3f")
_ANSWER = struct.Struct("<IBBHdff3ff3fffffffIdI")
_FORCE_GIVEN, _TIME_GIVEN, _NEEDLE_STAYS, _VOLUME_GIVEN, _PRESSURE_GIVEN = 1, 2, 4, 8, 16
_LEVELS = ("linear", "coarse", "reference", "network", "corrected")
_CONTACTS = ("clear", "touching", "slipping", "punctured")


@dataclass
class Surface:
    """The answer to a pose of a stream. Lists of nodes are in the order of `Stream.triangles`."""

    sequence: int
    client_time_us: float
    dropped: int  # poses since the last answer that a newer one overtook
    level: str
    contact: str
    calibrated: bool
    warned: bool
    received_us: float  # the server's clock; it began with the stream
    waited_us: float
    computed_us: float
    tip_mm: Tuple[float, ...]
    travel_mm: float
    reaction_mn: Tuple[float, ...]
    area_mm2: float
    max_strain: float
    max_pressure_kpa: float
    max_penetration_um: float
    expected_error_um: Tuple[float, ...]  # median and 95 %; NaN where unknown
    time_s: float  # of the pose in a session with memory, else 0
    vertices_mm: List[Tuple[float, ...]]
    normals: List[Tuple[float, ...]]
    displacement_um: Tuple[float, ...]
    triangles: Optional[List[Tuple[int, ...]]]  # of a patch that is cut from a mesh
    source_indices: Optional[Tuple[int, ...]]


def write_pose(
    sequence: int,
    client_time_us: float,
    tip_mm: Optional[Sequence[float]],
    orientation_xyzw: Sequence[float],
    force_mn: Optional[Sequence[float]],
    time_s: Optional[float],
    volume_mm3: Optional[float],
    pressure_kpa: Optional[float],
) -> bytes:
    """The binary message of a pose; of the fluid's volume and pressure one at most."""
    flags = (0 if force_mn is None else _FORCE_GIVEN) | (0 if time_s is None else _TIME_GIVEN)
    flags |= _NEEDLE_STAYS if tip_mm is None else 0
    flags |= (0 if volume_mm3 is None else _VOLUME_GIVEN) | (0 if pressure_kpa is None else _PRESSURE_GIVEN)
    tip, turned = ((0.0,) * 3, (0.0,) * 4) if tip_mm is None else (tip_mm, orientation_xyzw)
    force = (0.0,) * 3 if force_mn is None else force_mn
    header = _HEADER.pack(b"RTNA", 1, 1, flags, sequence, client_time_us)
    numbers = [number for number in (time_s, volume_mm3, pressure_kpa) if number is not None]
    return header + _POSE.pack(*tip, *turned, *force) + struct.pack(f"<{len(numbers)}d", *numbers)


def read_surface(message: bytes) -> Surface:
    """The answer in a binary message."""
    magic, version, kind, flags, sequence, time_us = _HEADER.unpack_from(message)
    if (magic, version, kind) != (b"RTNA", 1, 2):
        raise ValueError("not an answer of layout 1")
    f = _ANSWER.unpack_from(message, _HEADER.size)
    count, at = f[3], _HEADER.size + _ANSWER.size
    numbers = struct.unpack_from(f"<{7 * count}f", message, at)
    at += 28 * count
    triangles: Optional[List[Tuple[int, ...]]] = None
    source: Optional[Tuple[int, ...]] = None
    if flags & 4:
        (pieces,) = struct.unpack_from("<I", message, at)
        corners = struct.unpack_from(f"<{3 * pieces}I", message, at + 4)
        triangles = [corners[k : k + 3] for k in range(0, 3 * pieces, 3)]
        source = struct.unpack_from(f"<{count}I", message, at + 4 + 12 * pieces)
    triples = [numbers[k : k + 3] for k in range(0, 6 * count, 3)]
    return Surface(
        sequence=sequence,
        client_time_us=time_us,
        dropped=f[0],
        level=_LEVELS[f[1]],
        contact=_CONTACTS[f[2]],
        calibrated=bool(flags & 1),
        warned=bool(flags & 2),
        received_us=f[4],
        waited_us=f[5],
        computed_us=f[6],
        tip_mm=f[7:10],
        travel_mm=f[10],
        reaction_mn=f[11:14],
        area_mm2=f[14],
        max_strain=f[15],
        max_pressure_kpa=f[16],
        max_penetration_um=f[17],
        expected_error_um=f[18:20],
        time_s=f[21],
        vertices_mm=triples[:count],
        normals=triples[count:],
        displacement_um=numbers[6 * count :],
        triangles=triangles,
        source_indices=source,
    )
