"""Companion computers and their missions: they know a vehicle through MAVLink and camera frames alone."""
