"""Tests of the package without ROS: `python3 press.py URL`. Units and layouts, then the node against a running service."""

from __future__ import annotations

import pathlib
import struct
import sys
import threading
import unittest

URL = sys.argv.pop() if len(sys.argv) > 1 else "http://127.0.0.1:8080"
HERE = pathlib.Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import fake_ros  # noqa: E402

fake_ros.install()

from retina_client import Service  # noqa: E402
from retina_ros2 import convert  # noqa: E402
from retina_ros2.node import RetinaNode  # noqa: E402

PATIENCE_S = 20.0


class Conversions(unittest.TestCase):
    def test_lengths_and_forces_go_there_and_back(self) -> None:
        self.assertEqual(convert.mm([0.001, -0.25, 0.0]), [1.0, -250.0, 0.0])
        self.assertEqual(convert.mn([0.0008, 0.0, -0.0004]), [0.8, 0.0, -0.4])
        for there, back in ((convert.mm, convert.metres), (convert.mn, convert.newtons)):
            for given, told in zip([0.3, -7.25, 1e-6], back(there([0.3, -7.25, 1e-6]))):
                self.assertAlmostEqual(given, told, delta=1e-15)

    def test_a_quaternion_is_made_length_1_or_refused(self) -> None:
        self.assertEqual(convert.orientation([0.0, 0.0, 0.0, 1.0]), [0.0, 0.0, 0.0, 1.0])
        self.assertAlmostEqual(sum(part * part for part in convert.orientation([0.0, 0.6004, 0.0, 0.8])), 1.0, places=12)
        for wrong in ([0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [float("nan"), 0.0, 0.0, 1.0]):
            with self.assertRaises(ValueError):
                convert.orientation(wrong)

    def test_a_cloud_is_seven_floats_a_point(self) -> None:
        data = convert.cloud([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], [[0.0, 0.0, 1.0]] * 2, [10.0, 20.0])
        self.assertEqual(len(data), 2 * convert.POINT_STEP)
        self.assertEqual(struct.unpack_from("<3f", data, convert.POINT_STEP), struct.unpack("<3f", struct.pack("<3f", 0.004, 0.005, 0.006)))
        self.assertEqual([field.offset for field in convert.FIELDS], [0, 4, 8, 12, 16, 20, 24])
        self.assertAlmostEqual(struct.unpack_from("<f", data, 24)[0], 1e-5, delta=1e-11)

    def test_a_mesh_lists_the_corners_of_its_triangles(self) -> None:
        vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        self.assertEqual(convert.triangle_list(vertices, [[0, 1, 2]]), [[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.0, 0.001, 0.0]])


class Topics(unittest.TestCase):
    """Presses through the topics, and holds what comes against a prediction."""

    def setUp(self) -> None:
        fake_ros.Node.topics, fake_ros.Node.log = {}, []
        fake_ros.Node.parameters = {"url": URL, "level": "linear"}
        self.got: dict[str, object] = {}
        self.there = threading.Event()
        self.node = RetinaNode()
        for topic in ("retina/cloud", "retina/mesh", "needle/reaction", "needle/tip"):
            self.node.create_subscription(object, topic, lambda message, topic=topic: self.take(topic, message), 1)

    def tearDown(self) -> None:
        self.node.destroy_node()

    def take(self, topic: str, message: object) -> None:
        self.got[topic] = message
        if topic == "needle/tip":
            self.there.set()

    def send(self, topic: str, message: object) -> None:
        for callback in fake_ros.Node.topics[topic]:
            callback(message)

    def pose(self, x: float, y: float, z: float, stamp: int = 7, frame_id: str = "retina") -> object:
        pose = fake_ros.PoseStamped(header=fake_ros.Header(stamp=stamp, frame_id=frame_id))
        place = pose.pose.position
        place.x, place.y, place.z = x, y, z
        pose.pose.orientation.w = 1.0
        return pose

    def test_a_pose_and_a_wrench_press_the_retina(self) -> None:
        wrench = fake_ros.WrenchStamped(header=fake_ros.Header(stamp=3, frame_id="retina"))
        wrench.wrench.force.z = -0.0005
        self.send("needle/wrench", wrench)
        self.send("needle/pose", self.pose(0.000125, 0.0, 0.0, stamp=42))
        self.assertTrue(self.there.wait(PATIENCE_S), fake_ros.Node.log)
        alone = Service(URL).predict(
            {"needle": {"tip_mm": [0.125, 0.0, 0.0]}, "force_mn": [0.0, 0.0, -0.5], "accuracy": {"level": "linear"}}
        )
        cloud, mesh = self.got["retina/cloud"], self.got["retina/mesh"]
        self.assertEqual((cloud.header.stamp, cloud.header.frame_id, cloud.width), (42, "retina", 64))
        self.assertEqual((cloud.row_step, len(cloud.data)), (64 * 28, 64 * 28))
        for node, expected_mm in enumerate(alone["surface"]["vertices_mm"]):
            told_m = struct.unpack_from("<3f", cloud.data, node * cloud.point_step)
            for told, expected in zip(told_m, expected_mm):
                self.assertAlmostEqual(1000.0 * told, expected, delta=1e-6)
        self.assertEqual(len(mesh.points), 3 * 98)
        self.assertAlmostEqual(self.got["needle/reaction"].wrench.force.z, 0.0005, delta=1e-9)
        self.assertAlmostEqual(self.got["needle/tip"].pose.position.z, alone["needle"]["tip_mm"][2] / 1000.0, delta=1e-9)

    def test_what_cannot_be_is_said_and_the_node_goes_on(self) -> None:
        self.send("needle/pose", self.pose(0.0, 0.0, 0.0, frame_id="map"))
        self.assertTrue(any("'map'" in line for line in fake_ros.Node.log), fake_ros.Node.log)
        wrench = fake_ros.WrenchStamped(header=fake_ros.Header(frame_id="retina"))
        wrench.wrench.force.z = -0.0005
        self.send("needle/wrench", wrench)
        self.send("needle/pose", self.pose(0.009, 0.0, 0.0))
        while not any("no answer" in line for line in fake_ros.Node.log):
            self.assertFalse(self.there.wait(0.05))
        self.send("needle/pose", self.pose(0.0, 0.0, 0.0))
        self.assertTrue(self.there.wait(PATIENCE_S), fake_ros.Node.log)


if __name__ == "__main__":
    unittest.main()
