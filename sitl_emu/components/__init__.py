"""What a vehicle carries that speaks MAVLink by itself: camera and gimbal, as state machines on simulated time."""
