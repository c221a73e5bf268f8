"""The ground side: the client half of every MAVLink service, with PX4's numbers as literals."""
