"""`python -P -m sitl_emu.autopilot`: one autopilot alone. A door to `sitl_emu/run/autopilot_command.py`."""

import sys

from sitl_emu.run.autopilot_command import main

if __name__ == "__main__":
    sys.exit(main())
