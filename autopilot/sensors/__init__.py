"""From the simulator's messages to topics: samples, means, calibration, and which sensor is used (PX4: sensors)."""
