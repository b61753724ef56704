//! `clients/ros2`, without ROS.

use super::python;
use crate::harness::Running;

#[test]
fn the_ros_node_presses_through_its_topics() {
    let service = Running::start(&["--threads", "2"]);
    let Some((success, text)) = python("ros2/test/press.py", &[&service.url("")], "") else { return };
    assert!(success && text.contains("\nOK"), "{text}");
}
