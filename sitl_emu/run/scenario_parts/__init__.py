"""The parts of a scenario file, a module for each; `sitl_emu/run/scenario.py` is the whole."""
