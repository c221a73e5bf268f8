"""Mission items without a place: who carries them out, and how (PX4: MissionBlock::issue_command, v1.18)."""

import math

from sitl_emu.autopilot.commands.vehicle_commands import nearest
from sitl_emu.autopilot.navigator.mission_block import GATE, RELATIVE_FRAMES, RETURN_TO_LAUNCH
from sitl_emu.autopilot.navigator.mission_legs import DO_LAND_START
from sitl_emu.autopilot.navigator.payload import PAYLOAD_COMMANDS, Payload
from sitl_emu.autopilot.navigator.roi import ROI_COMMANDS, Roi
from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.autopilot.storage.dataman import MissionItem
from sitl_emu.autopilot.topics import VehicleCommand
from sitl_emu.core import dialect as mavlink

DO_CHANGE_SPEED = mavlink.MAV_CMD_DO_CHANGE_SPEED
OBEYED = frozenset(
    (
        RETURN_TO_LAUNCH,
        mavlink.MAV_CMD_DO_SET_HOME,
        mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
        mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE,
    )
)
"""Items that another module carries out as it would the command."""
GROUND_SPEED = mavlink.SPEED_TYPE_GROUNDSPEED
FRAME_MISSION: int = mavlink.MAV_FRAME_MISSION


class MissionCommands:
    """Has items carried out, whoever flies the mission."""

    def __init__(self, state: NavigatorState, roi: Roi, payload: Payload) -> None:
        self._state, self._roi, self._payload = state, roi, payload

    def issue(self, item: MissionItem) -> None:
        """An item without a place."""
        state = self._state
        if item.command in OBEYED:
            state.command(raw_command_of(item))
        elif item.command in PAYLOAD_COMMANDS:
            self._payload.issue(raw_command_of(item))
        elif item.command in ROI_COMMANDS:
            command = _roi_command_of(item, state.home_alt_m())
            self._roi.take(command)
            state.tell_obeyed(command)
        elif item.command not in (DO_LAND_START, GATE):
            command = raw_command_of(item)
            if item.command == DO_CHANGE_SPEED:
                change_speed(state, command)
                state.tell_obeyed(command)
            else:
                state.tell(command)


def change_speed(state: NavigatorState, command: VehicleCommand) -> None:
    """DO_CHANGE_SPEED: a speed from the next setpoint on, or the vehicle's own for anything that is not above 0.

    The leg that is flown gets it too if it is a ground speed (FlightModeManager::handleCommand).
    """
    is_speed = math.isfinite(command.param2) and command.param2 > 0.0
    state.cruising_speed_m_s = command.param2 if is_speed else -1.0
    if is_speed and nearest(command.param1) == GROUND_SPEED:
        state.fly_at_cruising_speed()


def _roi_command_of(item: MissionItem, home_alt_m: float) -> VehicleCommand:
    """A location has its place; of other regions of interest it is dropped."""
    command = raw_command_of(item)
    if item.command == mavlink.MAV_CMD_NAV_ROI:
        return command._replace(command=mavlink.MAV_CMD_DO_SET_ROI)
    if item.command != mavlink.MAV_CMD_DO_SET_ROI_LOCATION:
        return command
    alt_m = item.z + home_alt_m if item.frame in RELATIVE_FRAMES else item.z
    return command._replace(param5=item.lat_deg, param6=item.lon_deg, param7=alt_m)


def raw_command_of(item: MissionItem) -> VehicleCommand:
    """All seven parameters as they came in MAV_FRAME_MISSION; in a global frame PX4 has put x and y elsewhere.

    x and y are whole numbers, DO_SET_HOME's too, which so sets home to whole degrees.
    """
    param5, param6 = (float(item.x), float(item.y)) if item.frame == FRAME_MISSION else (0.0, 0.0)
    return VehicleCommand(
        item.command, item.param1, item.param2, item.param3, item.param4, param5, param6, item.z, from_external=False
    )
