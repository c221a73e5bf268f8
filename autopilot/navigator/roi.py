"""Region of interest: where the vehicle looks. PX4's Navigator, DO_SET_ROI* (v1.18)."""

import math

from autopilot.navigator.state import NavigatorState
from autopilot.topics import VehicleCommand, VehicleRoi
from sitl_emu.core import dialect as mavlink

ROI_COMMANDS = frozenset(
    (
        mavlink.MAV_CMD_DO_SET_ROI,
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION,
        mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET,
        mavlink.MAV_CMD_DO_SET_ROI_NONE,
        mavlink.MAV_CMD_NAV_ROI,
    )
)
MODE_WPNEXT: int = mavlink.MAV_ROI_WPNEXT
MODE_LOCATION: int = mavlink.MAV_ROI_LOCATION


class Roi:
    """Writes vehicle_roi."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state

    def take(self, command: VehicleCommand) -> None:
        """A DO_SET_ROI command; lat/lon in degrees, altitude AMSL."""
        number = command.command
        located = number == mavlink.MAV_CMD_DO_SET_ROI_LOCATION or (
            number in (mavlink.MAV_CMD_DO_SET_ROI, mavlink.MAV_CMD_NAV_ROI) and command.param1 in (0.0, MODE_LOCATION)
        )
        if located:
            self._state.topics.vehicle_roi = VehicleRoi(MODE_LOCATION, command.param5, command.param6, command.param7)
        elif number == mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET:
            pitch, roll, yaw = (math.radians(value) for value in (command.param5, command.param6, command.param7))
            self._state.topics.vehicle_roi = VehicleRoi(
                MODE_WPNEXT, roll_offset=roll, pitch_offset=pitch, yaw_offset=yaw
            )
        else:
            self._state.topics.vehicle_roi = VehicleRoi()
