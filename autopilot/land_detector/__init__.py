"""Whether the vehicle stands on the ground: PX4's land_detector, a file for each kind of it."""
