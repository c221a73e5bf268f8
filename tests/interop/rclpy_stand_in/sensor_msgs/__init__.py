"""Messages of ROS 2."""
