"""A level plain without end."""
