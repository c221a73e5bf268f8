"""sitl-emu: PX4 vehicles, their world and their missions, in one process each and from one install."""

__version__ = "0.1.0"

from sitl_emu import compiled

compiled.install()
