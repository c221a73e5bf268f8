"""One file per flight mode: from a goal to a trajectory setpoint, every tick."""
