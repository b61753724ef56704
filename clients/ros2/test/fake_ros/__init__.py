"""As much of ROS 2 as the node touches, for machines without it: messages hold what they are given, topics hand it on at once."""

from __future__ import annotations

import sys
import types
from typing import Any, Callable, Dict, List


class _Vector:
    def __init__(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, w: float = 0.0):
        self.x, self.y, self.z, self.w = x, y, z, w


class _Message:
    """A message whose fields are made as they are asked for, of the names that ROS gives them."""

    parts: Dict[str, Callable[[], Any]] = {}

    def __init__(self, **fields: Any):
        unknown = set(fields) - set(self.parts)
        if unknown:
            raise AssertionError(f"{type(self).__name__} has no {unknown}")
        for name, make in self.parts.items():
            setattr(self, name, fields[name] if name in fields else make())

    def __setattr__(self, name: str, value: Any) -> None:
        # rclpy refuses fields that a message has not.
        assert name in self.parts, f"{type(self).__name__} has no {name}"
        object.__setattr__(self, name, value)


def _message(name: str, constants: Dict[str, int] = {}, /, **parts: Callable[[], Any]) -> Any:
    return type(name, (_Message,), {"parts": parts, **constants})


Header = _message("Header", stamp=int, frame_id=str)
Point = _message("Point", x=float, y=float, z=float)
Pose = _message("Pose", position=_Vector, orientation=_Vector)
PoseStamped = _message("PoseStamped", header=Header, pose=Pose)
Wrench = _message("Wrench", force=_Vector, torque=_Vector)
WrenchStamped = _message("WrenchStamped", header=Header, wrench=Wrench)
PointField = _message("PointField", {"FLOAT32": 7}, name=str, offset=int, datatype=int, count=int)
PointCloud2 = _message(
    "PointCloud2",
    header=Header,
    height=int,
    width=int,
    fields=list,
    is_bigendian=bool,
    point_step=int,
    row_step=int,
    data=bytes,
    is_dense=bool,
)
Color = _message("ColorRGBA", r=float, g=float, b=float, a=float)
Marker = _message(
    "Marker",
    {"TRIANGLE_LIST": 11, "ADD": 0},
    header=Header,
    ns=str,
    id=int,
    type=int,
    action=int,
    pose=Pose,
    scale=_Vector,
    color=Color,
    points=list,
)


class Node:
    """A node whose topics are lists of callbacks."""

    topics: Dict[str, List[Callable[[Any], None]]] = {}
    parameters: Dict[str, Any] = {}
    log: List[str] = []

    def __init__(self, name: str):
        self.name = name

    def declare_parameter(self, name: str, usual: Any) -> Any:
        return types.SimpleNamespace(value=self.parameters.get(name, usual))

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Any], None], depth: int) -> None:
        self.topics.setdefault(topic, []).append(callback)

    def create_publisher(self, kind: type, topic: str, depth: int) -> Any:
        def publish(message: Any) -> None:
            assert isinstance(message, kind), (topic, message)
            for callback in self.topics.get(topic, []):
                callback(message)

        return types.SimpleNamespace(publish=publish)

    def get_logger(self) -> Any:
        return types.SimpleNamespace(warning=self.log.append, error=self.log.append, info=self.log.append)

    def destroy_node(self) -> None:
        pass


def install() -> None:
    """Puts these in the places of ROS 2's modules."""
    modules = {
        "rclpy": {},
        "rclpy.node": {"Node": Node},
        "geometry_msgs.msg": {"Point": Point, "PoseStamped": PoseStamped, "WrenchStamped": WrenchStamped},
        "sensor_msgs.msg": {"PointCloud2": PointCloud2, "PointField": PointField},
        "std_msgs.msg": {"Header": Header},
        "visualization_msgs.msg": {"Marker": Marker},
    }
    for name, contents in modules.items():
        parent = name.split(".")[0]
        sys.modules.setdefault(parent, types.ModuleType(parent))
        module = sys.modules.setdefault(name, types.ModuleType(name))
        module.__dict__.update(contents)
