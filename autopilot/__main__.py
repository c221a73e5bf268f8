"""`python -P -m autopilot`: one autopilot alone. A door; what is behind it: `sitl_emu/run/autopilot_command.py`."""

import sys

from sitl_emu.run.autopilot_command import main

if __name__ == "__main__":
    sys.exit(main())
