"""The retina under a needle as a ROS 2 node: `convert` is the units and layouts, `node` the topics."""
