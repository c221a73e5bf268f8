"""Region of interest: where the vehicle looks. PX4's Navigator, DO_SET_ROI* (v1.18)."""

import math

from sitl_emu.autopilot.commands.table import Role, items_where
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.topics import PositionSetpoint, VehicleCommand, VehicleRoi
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import bearing_rad, distance_m, wrap_pi

ROI_COMMANDS = items_where(lambda item: item.role is Role.ROI)
MODE_WPNEXT: int = mavlink.MAV_ROI_WPNEXT
MODE_LOCATION: int = mavlink.MAV_ROI_LOCATION


class Roi:
    """Writes vehicle_roi, and tells a mission's waypoints where to look."""

    def __init__(self, state: NavigatorState) -> None:
        self._state = state
        self._roi = VehicleRoi()

    def forget(self) -> None:
        """A mission begins without one; vehicle_roi, which gimbals follow, stays (Navigator::reset_vroi)."""
        self._roi = VehicleRoi()

    def yaw_rad(self, waypoint: PositionSetpoint) -> float | None:
        """Towards what is looked at (MissionBase::heading_sp_update); nearer than a waypoint's radius as before.

        None: nothing is, or MIS_MNT_YAW_CTL leaves it to a gimbal.
        """
        roi, state = self._roi, self._state
        if state.settings.mis_mnt_yaw_ctl or not waypoint.valid:
            return None
        if roi.mode == MODE_LOCATION:
            lat_deg, lon_deg, offset_rad = roi.lat, roi.lon, 0.0
        elif roi.mode == MODE_WPNEXT:
            lat_deg, lon_deg, offset_rad = waypoint.lat, waypoint.lon, roi.yaw_offset
        else:
            return None
        here = state.position.lat, state.position.lon
        if distance_m(*here, lat_deg, lon_deg) <= state.acceptance_radius_m():
            return waypoint.yaw
        return wrap_pi(bearing_rad(*here, lat_deg, lon_deg) + offset_rad)

    def take(self, command: VehicleCommand) -> None:
        """A DO_SET_ROI command; lat/lon in degrees, altitude AMSL.

        The deprecated ones choose a mode alone: their place is dropped, so that a location is where both are 0.
        """
        number = command.command
        if number == mavlink.MAV_CMD_DO_SET_ROI_LOCATION:
            roi = VehicleRoi(MODE_LOCATION, command.param5, command.param6, command.param7)
        elif number == mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET:
            pitch, roll, yaw = (math.radians(value) for value in (command.param5, command.param6, command.param7))
            roi = VehicleRoi(MODE_WPNEXT, roll_offset=roll, pitch_offset=pitch, yaw_offset=yaw)
        elif number == mavlink.MAV_CMD_DO_SET_ROI_NONE:
            roi = VehicleRoi()
        else:
            mode = int(command.param1) & 0xFF if math.isfinite(command.param1) else 0
            roi = VehicleRoi(mode)
        self._roi = self._state.topics.vehicle_roi = roi._replace(timestamp=self._state.now_us)
