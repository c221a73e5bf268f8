"""From radio channels and joysticks to the sticks that are flown (PX4: rc_update, manual_control)."""
