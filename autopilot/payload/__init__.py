"""What is carried: camera trigger, gimbal manager and gripper (PX4: camera_trigger, gimbal, payload_deliverer)."""
