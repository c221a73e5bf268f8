"""Cascaded controllers with PX4's names and parameters."""
