"""What each mode needs to be flown, and which modes forbid arming.

PX4's src/modules/commander/ModeUtil/mode_requirements.cpp (v1.18); the table is `flight_mode.FLIGHT_MODES`.
"""

from sitl_emu.autopilot.flight_mode import FLIGHT_MODES, Need, modes_where
from sitl_emu.autopilot.topics import FailsafeFlags

NEEDS = {state: mode.needs for state, mode in FLIGHT_MODES.items()}
MODES_THAT_NEED = {need: sum(1 << mode for mode, needs in NEEDS.items() if need in needs) for need in Need}
"""Bit per NavState."""
PREVENT_ARMING = modes_where(lambda mode: mode.prevents_arming)
ALL_MODES = sum(1 << state for state in NEEDS)
PREVENT_ARMING_MODES = sum(1 << state for state in PREVENT_ARMING)
VALID_MODES = sum(1 << state for state, mode in FLIGHT_MODES.items() if mode.valid)
SELECTABLE_MODES = sum(1 << state for state, mode in FLIGHT_MODES.items() if mode.selectable)
"""vehicle_status: which modes there are, and which may be chosen."""
FIELDS: dict[Need, str] = {
    Need.ANGULAR_VELOCITY: "mode_req_angular_velocity",
    Need.ATTITUDE: "mode_req_attitude",
    Need.LOCAL_ALT: "mode_req_local_alt",
    Need.LOCAL_POSITION_RELAXED: "mode_req_local_position_relaxed",
    Need.GLOBAL_POSITION: "mode_req_global_position",
    Need.HOME_POSITION: "mode_req_home_position",
    Need.MISSION: "mode_req_mission",
    Need.OFFBOARD_SIGNAL: "mode_req_offboard_signal",
    Need.MANUAL_CONTROL: "mode_req_manual_control",
    Need.WIND_AND_FLIGHT_TIME: "mode_req_wind_and_flight_time_compliance",
    Need.OTHER: "mode_req_other",
}
"""Names in failsafe_flags; that of LOCAL_POSITION is written with each record."""
NOTHING = Need(0)


def requirement_masks() -> dict[str, float | str]:
    """The mode_req_* of failsafe_flags: a bit per mode that has the need."""
    masks: dict[str, float | str] = {
        field: sum(1 << state for state, need in NEEDS.items() if need & each) for each, field in FIELDS.items()
    }
    masks["mode_req_prevent_arming"] = PREVENT_ARMING_MODES
    masks["mode_req_global_position_relaxed"] = 0
    return masks


def modes_that_need_local_position(*, flies: bool) -> int:
    """Bit per NavState; what does not fly takes off without one."""
    in_flight = MODES_THAT_NEED[Need.LOCAL_POSITION_TO_TAKE_OFF] if flies else 0
    return MODES_THAT_NEED[Need.LOCAL_POSITION] | in_flight


def missing(flags: FailsafeFlags, *, flies: bool = True) -> Need:
    """Everything that a mode could need and that is not there now."""
    need = Need.OTHER
    if flags.angular_velocity_invalid:
        need |= Need.ANGULAR_VELOCITY
    if flags.attitude_invalid:
        need |= Need.ATTITUDE
    if flags.local_altitude_invalid:
        need |= Need.LOCAL_ALT
    if flags.local_position_invalid:
        need |= Need.LOCAL_POSITION | (Need.LOCAL_POSITION_TO_TAKE_OFF if flies else NOTHING)
    if flags.local_position_invalid_relaxed:
        need |= Need.LOCAL_POSITION_RELAXED
    if flags.global_position_invalid:
        need |= Need.GLOBAL_POSITION
    if flags.home_position_invalid:
        need |= Need.HOME_POSITION
    if flags.auto_mission_missing:
        need |= Need.MISSION
    if flags.offboard_control_signal_lost:
        need |= Need.OFFBOARD_SIGNAL
    if flags.manual_control_signal_lost:
        need |= Need.MANUAL_CONTROL
    if flags.wind_limit_exceeded or flags.flight_time_limit_exceeded:
        need |= Need.WIND_AND_FLIGHT_TIME
    return need


def runnable_modes(flags: FailsafeFlags, unasked: Need = NOTHING, *, flies: bool = True) -> int:
    """Bit per NavState: everything that the mode needs is there, but what is not asked for."""
    lacking = int(missing(flags, flies=flies) & ~unasked)
    modes = 0
    for state, need in _NEEDS_AS_INT:
        if not need & lacking:
            modes |= 1 << state
    return modes


_NEEDS_AS_INT = tuple((int(state), int(need)) for state, need in NEEDS.items())
