"""The node: subscribes to the needle's pose and wrench, publishes the deformed retina.

Topics (units of REP 103: m, N), all in the frame of the parameter `frame_id`:
- in: `needle/pose` (PoseStamped, the needle points along its −z), `needle/wrench` (WrenchStamped, the force on the tissue; the newest one holds
  for the poses after it; a force of zero or none at all holds the needle where it is);
- out: `retina/cloud` (PointCloud2: positions, normals, displacements), `retina/mesh` (Marker, TRIANGLE_LIST), `needle/reaction`
  (WrenchStamped, the tissue's force on the needle), `needle/tip` (PoseStamped, the needle at equilibrium).

Answers carry the stamp of their pose. The newest pose wins; a message in another frame is refused and said so, since it would be answered wrongly.
"""

from __future__ import annotations

import threading
from typing import Any, List, Optional, cast

import rclpy
from geometry_msgs.msg import Point, PoseStamped, WrenchStamped
from rclpy.node import Node
from retina_client import Problem, Service, Stream, StreamClosed, Surface
from retina_client.messages import OpenSpec, TipName
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from . import convert

# How long to wait before a service that is not there is tried again.
RETRY_S = 1.0


class RetinaNode(Node):  # type: ignore[misc]
    """A stream to the service, and the topics."""

    def __init__(self, **more: Any) -> None:
        super().__init__("retina", **more)
        self._service = Service(self._text("url", "http://127.0.0.1:8080"), self._text("token", "") or None)
        self._session: OpenSpec = {
            "scene": self._text("scene", "macula"),
            "needle": {"gauge": self._text("gauge", "25G"), "tip": cast(TipName, self._text("tip", "hemispherical"))},
            "accuracy": {"level": self._text("level", "network")},
        }
        self._frame_id = self._text("frame_id", "retina")
        self._cloud = self.create_publisher(PointCloud2, "retina/cloud", 1)
        self._mesh = self.create_publisher(Marker, "retina/mesh", 1)
        self._reaction = self.create_publisher(WrenchStamped, "needle/reaction", 1)
        self._tip = self.create_publisher(PoseStamped, "needle/tip", 1)
        self.create_subscription(WrenchStamped, "needle/wrench", self._take_wrench, 1)
        self.create_subscription(PoseStamped, "needle/pose", self._take_pose, 1)
        self._force_mn: Optional[List[float]] = None
        self._newest: Optional[PoseStamped] = None
        self._changed = threading.Condition()
        self._ends = False
        self._worker = threading.Thread(target=self._work, name="retina", daemon=True)
        self._worker.start()

    def _text(self, name: str, usual: str) -> str:
        return str(self.declare_parameter(name, usual).value)

    def destroy_node(self) -> None:
        """Ends the stream, then the node."""
        with self._changed:
            self._ends = True
            self._changed.notify()
        self._worker.join(timeout=5.0)
        super().destroy_node()

    def _is_ours(self, message: Any, topic: str) -> bool:
        if message.header.frame_id == self._frame_id:
            return True
        other = message.header.frame_id
        self.get_logger().warning(f"{topic} is in the frame {other!r} and not in {self._frame_id!r}; it is left out")
        return False

    def _take_wrench(self, message: Any) -> None:
        if self._is_ours(message, "needle/wrench"):
            force = message.wrench.force
            force_mn = convert.mn((force.x, force.y, force.z))
            self._force_mn = force_mn if any(force_mn) else None

    def _take_pose(self, message: Any) -> None:
        if self._is_ours(message, "needle/pose"):
            with self._changed:
                self._newest = message
                self._changed.notify()

    def _work(self) -> None:
        """Answers the newest pose, one after the other, on a stream that is opened again when it ends."""
        while not self._ends:
            try:
                with self._service.stream(self._session) as stream:
                    while self._answer_next(stream):
                        pass
            except Problem as problem:
                self.get_logger().error(f"the service refuses the session: {problem}")
            except (OSError, StreamClosed) as error:
                self.get_logger().warning(f"no service: {error}")
            with self._changed:
                self._changed.wait_for(lambda: self._ends, RETRY_S)

    def _answer_next(self, stream: Stream) -> bool:
        """Waits for a pose and publishes its answer; false when the node ends."""
        with self._changed:
            self._changed.wait_for(lambda: self._ends or self._newest is not None)
            message, self._newest = self._newest, None
        if self._ends or message is None:
            return False
        position, turned = message.pose.position, message.pose.orientation
        try:
            tip_mm = convert.mm(convert.finite("the position", (position.x, position.y, position.z)))
            xyzw = convert.orientation((turned.x, turned.y, turned.z, turned.w))
            force_mn = self._force_mn and list(convert.finite("the force", self._force_mn))
            surface = stream.ask(tip_mm, force_mn, orientation_xyzw=xyzw)
        except (Problem, ValueError) as error:
            self.get_logger().warning(f"no answer to this pose: {error}")
            return True
        self._publish(message, surface, stream)
        return True

    def _publish(self, asked: Any, surface: Surface, stream: Stream) -> None:
        header = Header(stamp=asked.header.stamp, frame_id=self._frame_id)
        count = len(surface.vertices_mm)
        fields = [PointField(name=name, offset=offset, datatype=PointField.FLOAT32, count=1) for name, offset in convert.FIELDS]
        cloud = PointCloud2(header=header, height=1, width=count, fields=fields, is_bigendian=False, is_dense=True)
        cloud.point_step, cloud.row_step = convert.POINT_STEP, convert.POINT_STEP * count
        cloud.data = convert.cloud(surface.vertices_mm, surface.normals, surface.displacement_um)
        self._cloud.publish(cloud)
        mesh = Marker(header=header, ns="retina", id=0, type=Marker.TRIANGLE_LIST, action=Marker.ADD)
        mesh.pose.orientation.w = 1.0
        mesh.scale.x = mesh.scale.y = mesh.scale.z = 1.0
        mesh.color.r, mesh.color.g, mesh.color.b, mesh.color.a = 0.9, 0.5, 0.4, 1.0
        corners = convert.triangle_list(surface.vertices_mm, surface.triangles or stream.triangles)
        mesh.points = [Point(x=x, y=y, z=z) for x, y, z in corners]
        self._mesh.publish(mesh)
        reaction = WrenchStamped(header=header)
        force = reaction.wrench.force
        force.x, force.y, force.z = convert.newtons(surface.reaction_mn)
        self._reaction.publish(reaction)
        tip = PoseStamped(header=header)
        tip.pose.orientation = asked.pose.orientation
        place = tip.pose.position
        place.x, place.y, place.z = convert.metres(surface.tip_mm)
        self._tip.publish(tip)


def main(arguments: Optional[List[str]] = None) -> None:
    """Runs the node until it is interrupted."""
    rclpy.init(args=arguments)
    node = RetinaNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
