"""The flight mode, by command or by the old message.

Sources: https://mavlink.io/en/messages/common.html#MAV_CMD_DO_SET_MODE, and #SET_MODE, which that page calls deprecated
and QGroundControl still sends; PX4 acknowledges both as DO_SET_MODE.
"""

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.command import Command
from sitl_emu.gcs.modes import MODES

DO_SET_MODE = 176
MODE_FLAG_CUSTOM_MODE_ENABLED = 1


def set_mode(system: int, mode: str) -> Command:
    """Changes the flight mode of an autopilot; `mode` is a name of `gcs.modes.MODES`."""
    return Command(system, 1, DO_SET_MODE, (MODE_FLAG_CUSTOM_MODE_ENABLED, *MODES[mode]))


class SetModeMessage(Command):
    """The same by SET_MODE, for autopilots that know no other."""

    def __init__(self, system: int, mode: str) -> None:
        """`mode` is a name of `gcs.modes.MODES`; raises KeyError for another."""
        main, sub = MODES[mode]
        super().__init__(system, 1, DO_SET_MODE)
        self._custom_mode = main << 16 | sub << 24

    def _message(self) -> mavlink.MAVLink_message:
        return mavlink.MAVLink_set_mode_message(self.target_system, MODE_FLAG_CUSTOM_MODE_ENABLED, self._custom_mode)
