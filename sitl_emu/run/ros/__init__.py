"""A run's clock, sensors and frames as ROS 2's own messages, beside PX4's (autopilot/uxrce_dds_client)."""
