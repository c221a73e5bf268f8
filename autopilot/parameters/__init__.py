"""The autopilot's parameters: their set, the files that keep them, and what corrects them (PX4: lib/parameters)."""

from sitl_emu.autopilot.parameters.parameters import SET_AT_EACH_START, Parameters, Value, matches
from sitl_emu.autopilot.parameters.table import table

__all__ = ["SET_AT_EACH_START", "Parameters", "Value", "matches", "table"]
