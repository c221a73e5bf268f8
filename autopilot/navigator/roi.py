"""Region of interest: where the vehicle looks. PX4's Navigator, DO_SET_ROI* (v1.18)."""

import math

from sitl_emu.autopilot.commands.table import Role, items_where
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import VehicleCommand, VehicleRoi
from sitl_emu.core import dialect as mavlink

ROI_COMMANDS = items_where(lambda item: item.role is Role.ROI)
MODE_WPNEXT: int = mavlink.MAV_ROI_WPNEXT
MODE_LOCATION: int = mavlink.MAV_ROI_LOCATION


class Roi:
    """Writes vehicle_roi."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state

    def take(self, command: VehicleCommand) -> None:
        """A DO_SET_ROI command; lat/lon in degrees, altitude AMSL.

        The deprecated ones choose a mode alone: their place is dropped, so that a location is where both are 0.
        """
        number, topics = command.command, self._state.topics
        if number == mavlink.MAV_CMD_DO_SET_ROI_LOCATION:
            topics.vehicle_roi = VehicleRoi(MODE_LOCATION, command.param5, command.param6, command.param7)
        elif number == mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET:
            pitch, roll, yaw = (math.radians(value) for value in (command.param5, command.param6, command.param7))
            topics.vehicle_roi = VehicleRoi(MODE_WPNEXT, roll_offset=roll, pitch_offset=pitch, yaw_offset=yaw)
        elif number == mavlink.MAV_CMD_DO_SET_ROI_NONE:
            topics.vehicle_roi = VehicleRoi()
        else:
            mode = int(command.param1) & 0xFF if math.isfinite(command.param1) else 0
            topics.vehicle_roi = VehicleRoi(mode, 0.0, 0.0, 0.0)
