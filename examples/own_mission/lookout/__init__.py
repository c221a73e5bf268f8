"""A mission of one's own, as a package that sitl-emu finds by its entry point."""
