"""PX4's messages."""
