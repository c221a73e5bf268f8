"""Flight modes: one row for each, from which numbers, names, requirements, flags and who flies it follow.

PX4 v1.18 has this in lib/modes, commander/px4_custom_mode.h, commander/ModeUtil (requirements, control mode) and
flight_mode_manager. A new mode is its number in `constants.NavState`, a row here, the task or drive mode that flies it
and, where it follows a triplet, its place in the navigator. External modes have nobody to fly them here: they can be
chosen on the ground but never run. Numbers that are free are modes that need nothing and fly nothing: COM_FLTMODE_BOOT
may name one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, IntFlag, auto
from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import NavState
from sitl_emu.core import dialect as mavlink


class Need(IntFlag):
    """Conditions, each answered by a flag of FailsafeFlags."""

    ANGULAR_VELOCITY = auto()
    ATTITUDE = auto()
    LOCAL_ALT = auto()
    LOCAL_POSITION = auto()
    LOCAL_POSITION_TO_TAKE_OFF = auto()
    """As LOCAL_POSITION, of what flies."""
    LOCAL_POSITION_RELAXED = auto()
    """However inexact."""
    GLOBAL_POSITION = auto()
    HOME_POSITION = auto()
    MISSION = auto()
    OFFBOARD_SIGNAL = auto()
    MANUAL_CONTROL = auto()
    WIND_AND_FLIGHT_TIME = auto()
    OTHER = auto()
    """Never met: nobody runs the mode."""


class ControlMode(NamedTuple):
    """uORB vehicle_control_mode: which controllers run, and on whose behalf (flag_control_*_enabled)."""

    position: bool = False
    velocity: bool = False
    attitude: bool = False
    rates: bool = False
    allocation: bool = False
    altitude: bool = False
    climb_rate: bool = False
    manual: bool = False
    auto: bool = False
    offboard: bool = False


NOTHING = ControlMode()
THRUST_AND_TORQUE = ControlMode(allocation=True)
RATES = THRUST_AND_TORQUE._replace(rates=True)
ATTITUDE = RATES._replace(attitude=True)
ALTITUDE = ATTITUDE._replace(altitude=True, climb_rate=True)
TRAJECTORY = ALTITUDE._replace(position=True, velocity=True)
POSITION_TRIPLET = TRAJECTORY._replace(auto=True)
"""By what sets it, under the names of PX4's SetpointType (commander/ModeUtil/setpoint_types.cpp)."""


class Task(Enum):
    """What flies a multicopter by setpoints: a flight task (flight_mode_manager/tasks)."""

    AUTO = auto()
    MANUAL_POSITION = auto()
    MANUAL_POSITION_SLOW = auto()
    MANUAL_ALTITUDE = auto()
    ALTITUDE_CRUISE = auto()
    DESCEND = auto()
    ORBIT = auto()
    FOLLOW_TARGET = auto()
    OFFBOARD = auto()


class DriveMode(Enum):
    """What gives an Ackermann rover something to do (rover_ackermann/AckermannDriveModes)."""

    AUTO = auto()
    MANUAL = auto()
    OFFBOARD = auto()


class LinkLossException(IntFlag):
    """Bits of COM_RCL_EXCEPT and COM_DLL_EXCEPT."""

    NONE = 0
    MISSION = 1
    AUTO_MODES = 2
    OFFBOARD = 4
    EXTERNAL_MODE = 8
    ALTITUDE_CRUISE = 16


MAIN_MANUAL = 1
MAIN_ALTCTL = 2
MAIN_POSCTL = 3
MAIN_AUTO: Final = 4
MAIN_ACRO = 5
MAIN_OFFBOARD = 6
MAIN_STABILIZED = 7
MAIN_TERMINATION = 10
MAIN_ALTITUDE_CRUISE = 11
"""PX4_CUSTOM_MAIN_MODE."""
UNKNOWN_TO_EVENTS = 255
_NEEDS_ATTITUDE = Need.ANGULAR_VELOCITY | Need.ATTITUDE
_NEEDS_ALTITUDE = _NEEDS_ATTITUDE | Need.LOCAL_ALT
_NEEDS_POSITION = _NEEDS_ALTITUDE | Need.LOCAL_POSITION
_NEEDS_POSITION_RELAXED = _NEEDS_ALTITUDE | Need.LOCAL_POSITION_RELAXED
_NEEDS_GLOBAL = _NEEDS_POSITION | Need.GLOBAL_POSITION


@dataclass(frozen=True, kw_only=True, slots=True)
class FlightMode:
    """What PX4 knows of a mode."""

    name: str
    """In texts (lib/modes/ui.hpp)."""
    main_mode: int
    sub_mode: int = 0
    """Of custom_mode (px4_custom_mode.h)."""
    event_number: int = UNKNOWN_TO_EVENTS
    """navigation_mode_t of the events (lib/events/enums.json)."""
    standard_mode: int = mavlink.MAV_STANDARD_MODE_NON_STANDARD
    """MAV_STANDARD_MODE, on kinds that have it (Traits.no_standard_modes)."""
    advanced: bool = True
    """MAV_MODE_PROPERTY_ADVANCED (ui.hpp, isAdvanced)."""
    valid: bool = True
    """It is listed (ui.hpp, getValidNavStates)."""
    selectable: bool = True
    """The ground may choose it (vehicle_status.can_set_nav_states_mask)."""
    by_set_mode: bool = True
    """DO_SET_MODE knows it by its main and sub mode (Commander::handle_command)."""
    slot: int | None = None
    """Value of COM_FLTMODEn (ManualControl::navStateFromParam)."""
    shell_name: str | None = None
    """Word of `commander mode` (Commander::custom_command)."""
    needs: Need
    """To be flown (ModeUtil/mode_requirements.cpp)."""
    prevents_arming: bool = False
    control: ControlMode
    """ModeUtil/control_mode.cpp; OFFBOARD has what its setpoint asks for, at most this."""
    task: Task | None = None
    drive_mode: DriveMode | None = None
    link_loss_exception: LinkLossException = LinkLossException.NONE
    """Bit by which the loss of a link is no failsafe here."""
    ignores_gcs_loss: bool = False
    """The loss of the ground station is none in any case: it comes down already (failsafe.cpp, checkStateAndMode)."""
    mission_is_active: bool = False
    """A mission counts as active, armed or not (mavlink_mission.cpp, update_mission_state)."""
    setpoint_tells_landed_state: bool = False
    """EXTENDED_SYS_STATE says takeoff or landing by the setpoint that is flown."""


def _free(name: str) -> FlightMode:
    return FlightMode(
        name=name, main_mode=0, valid=False, selectable=False, by_set_mode=False, needs=Need(0), control=NOTHING
    )


FLIGHT_MODES: Mapping[NavState, FlightMode] = {
    NavState.MANUAL: FlightMode(
        name="Manual",
        main_mode=MAIN_MANUAL,
        event_number=0,
        slot=0,
        shell_name="manual",
        needs=Need.MANUAL_CONTROL,
        control=ATTITUDE._replace(manual=True),
        drive_mode=DriveMode.MANUAL,
    ),
    NavState.ALTCTL: FlightMode(
        name="Altitude",
        main_mode=MAIN_ALTCTL,
        event_number=1,
        standard_mode=mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD,
        advanced=False,
        slot=1,
        shell_name="altctl",
        needs=_NEEDS_ALTITUDE | Need.MANUAL_CONTROL,
        control=ALTITUDE._replace(manual=True),
        task=Task.MANUAL_ALTITUDE,
    ),
    NavState.POSCTL: FlightMode(
        name="Position",
        main_mode=MAIN_POSCTL,
        event_number=2,
        standard_mode=mavlink.MAV_STANDARD_MODE_POSITION_HOLD,
        advanced=False,
        slot=2,
        shell_name="posctl",
        needs=_NEEDS_POSITION_RELAXED | Need.MANUAL_CONTROL,
        control=TRAJECTORY._replace(manual=True),
        task=Task.MANUAL_POSITION,
        drive_mode=DriveMode.MANUAL,
    ),
    NavState.AUTO_MISSION: FlightMode(
        name="Mission",
        main_mode=MAIN_AUTO,
        sub_mode=4,
        event_number=3,
        standard_mode=mavlink.MAV_STANDARD_MODE_MISSION,
        slot=3,
        shell_name="auto:mission",
        needs=_NEEDS_GLOBAL | Need.MISSION | Need.WIND_AND_FLIGHT_TIME,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        drive_mode=DriveMode.AUTO,
        link_loss_exception=LinkLossException.MISSION,
        mission_is_active=True,
        setpoint_tells_landed_state=True,
    ),
    NavState.AUTO_LOITER: FlightMode(
        name="Hold",
        main_mode=MAIN_AUTO,
        sub_mode=3,
        event_number=4,
        slot=4,
        shell_name="auto:loiter",
        needs=_NEEDS_GLOBAL | Need.WIND_AND_FLIGHT_TIME,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        drive_mode=DriveMode.AUTO,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.AUTO_RTL: FlightMode(
        name="Return",
        main_mode=MAIN_AUTO,
        sub_mode=5,
        event_number=5,
        standard_mode=mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY,
        slot=5,
        shell_name="auto:rtl",
        needs=_NEEDS_GLOBAL | Need.HOME_POSITION,
        prevents_arming=True,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        drive_mode=DriveMode.AUTO,
        setpoint_tells_landed_state=True,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.POSITION_SLOW: FlightMode(
        name="Position Slow",
        main_mode=MAIN_POSCTL,
        sub_mode=2,
        event_number=9,
        slot=9,
        shell_name="position:slow",
        needs=_NEEDS_POSITION_RELAXED | Need.MANUAL_CONTROL,
        control=TRAJECTORY._replace(manual=True),
        task=Task.MANUAL_POSITION_SLOW,
    ),
    NavState.GUIDED_COURSE: FlightMode(
        name="Guided Course",
        main_mode=MAIN_AUTO,
        sub_mode=19,
        event_number=25,
        shell_name="auto:course",
        needs=_NEEDS_POSITION_RELAXED | Need.WIND_AND_FLIGHT_TIME,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.ALTITUDE_CRUISE: FlightMode(
        name="Altitude Cruise",
        main_mode=MAIN_ALTITUDE_CRUISE,
        event_number=24,
        slot=16,
        shell_name="altitude_cruise",
        needs=_NEEDS_ALTITUDE | Need.MANUAL_CONTROL,
        control=ALTITUDE._replace(manual=True),
        task=Task.ALTITUDE_CRUISE,
        link_loss_exception=LinkLossException.ALTITUDE_CRUISE,
    ),
    NavState.FREE3: _free("9: unallocated"),
    NavState.ACRO: FlightMode(
        name="Acro",
        main_mode=MAIN_ACRO,
        event_number=6,
        slot=6,
        shell_name="acro",
        needs=Need.ANGULAR_VELOCITY | Need.MANUAL_CONTROL,
        control=RATES._replace(manual=True),
        drive_mode=DriveMode.MANUAL,
    ),
    NavState.FREE2: _free("11: UNUSED"),
    NavState.DESCEND: FlightMode(
        name="Descend",
        main_mode=MAIN_AUTO,
        sub_mode=6,
        valid=False,
        selectable=False,
        by_set_mode=False,
        needs=_NEEDS_ATTITUDE,
        prevents_arming=True,
        control=ATTITUDE._replace(climb_rate=True, auto=True),
        task=Task.DESCEND,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.TERMINATION: FlightMode(
        name="Termination",
        main_mode=MAIN_TERMINATION,
        selectable=False,
        by_set_mode=False,
        needs=Need(0),
        prevents_arming=True,
        control=NOTHING,
    ),
    NavState.OFFBOARD: FlightMode(
        name="Offboard",
        main_mode=MAIN_OFFBOARD,
        event_number=7,
        slot=7,
        shell_name="offboard",
        needs=_NEEDS_ATTITUDE | Need.OFFBOARD_SIGNAL,
        control=TRAJECTORY._replace(offboard=True),
        task=Task.OFFBOARD,
        drive_mode=DriveMode.OFFBOARD,
        link_loss_exception=LinkLossException.OFFBOARD,
    ),
    NavState.STAB: FlightMode(
        name="Stabilized",
        main_mode=MAIN_STABILIZED,
        event_number=8,
        slot=8,
        shell_name="stabilized",
        needs=_NEEDS_ATTITUDE | Need.MANUAL_CONTROL,
        control=ATTITUDE._replace(manual=True),
        drive_mode=DriveMode.MANUAL,
    ),
    NavState.FREE1: _free("16: UNUSED2"),
    NavState.AUTO_TAKEOFF: FlightMode(
        name="Takeoff",
        main_mode=MAIN_AUTO,
        sub_mode=2,
        event_number=10,
        standard_mode=mavlink.MAV_STANDARD_MODE_TAKEOFF,
        slot=10,
        shell_name="auto:takeoff",
        needs=_NEEDS_ALTITUDE | Need.LOCAL_POSITION_TO_TAKE_OFF,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        link_loss_exception=LinkLossException.AUTO_MODES,
        mission_is_active=True,
        setpoint_tells_landed_state=True,
    ),
    NavState.AUTO_LAND: FlightMode(
        name="Land",
        main_mode=MAIN_AUTO,
        sub_mode=6,
        event_number=11,
        standard_mode=mavlink.MAV_STANDARD_MODE_LAND,
        slot=11,
        shell_name="auto:land",
        needs=_NEEDS_POSITION_RELAXED,
        prevents_arming=True,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        ignores_gcs_loss=True,
        mission_is_active=True,
        setpoint_tells_landed_state=True,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.AUTO_FOLLOW_TARGET: FlightMode(
        name="Follow Target",
        main_mode=MAIN_AUTO,
        sub_mode=8,
        event_number=12,
        slot=12,
        needs=_NEEDS_POSITION | Need.WIND_AND_FLIGHT_TIME,
        prevents_arming=True,
        control=TRAJECTORY,
        task=Task.FOLLOW_TARGET,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.AUTO_PRECLAND: FlightMode(
        name="Precision Landing",
        main_mode=MAIN_AUTO,
        sub_mode=9,
        event_number=13,
        slot=13,
        shell_name="auto:precland",
        needs=_NEEDS_POSITION,
        prevents_arming=True,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        ignores_gcs_loss=True,
        setpoint_tells_landed_state=True,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.ORBIT: FlightMode(
        name="Orbit",
        main_mode=MAIN_POSCTL,
        sub_mode=1,
        event_number=14,
        slot=14,
        standard_mode=mavlink.MAV_STANDARD_MODE_ORBIT,
        by_set_mode=False,
        needs=_NEEDS_POSITION | Need.WIND_AND_FLIGHT_TIME,
        prevents_arming=True,
        control=TRAJECTORY,
        task=Task.ORBIT,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    NavState.AUTO_VTOL_TAKEOFF: FlightMode(
        name="VTOL Takeoff",
        main_mode=MAIN_AUTO,
        sub_mode=10,
        event_number=15,
        slot=15,
        by_set_mode=False,
        needs=_NEEDS_POSITION,
        control=POSITION_TRIPLET,
        task=Task.AUTO,
        link_loss_exception=LinkLossException.AUTO_MODES,
    ),
    **{
        NavState(NavState.EXTERNAL1 + index): FlightMode(
            name=f"External {index + 1}",
            main_mode=MAIN_AUTO,
            sub_mode=11 + index,
            event_number=16 + index,
            advanced=False,
            selectable=False,
            slot=100 + index,
            shell_name="ext1" if index == 0 else None,
            needs=Need.OTHER,
            control=TRAJECTORY,
            link_loss_exception=LinkLossException.EXTERNAL_MODE,
        )
        for index in range(8)
    },
}


def modes_where(condition: Callable[[FlightMode], bool]) -> frozenset[NavState]:
    """The modes whose rows fulfil a condition."""
    return frozenset(state for state, mode in FLIGHT_MODES.items() if condition(mode))


FLOWN_BY_STICKS = modes_where(lambda mode: mode.control.manual)
STICKS_TO_THRUST = modes_where(lambda mode: mode.control.manual and not mode.control.climb_rate)
"""In these the throttle stick is the thrust itself; no task flies a multicopter there."""
