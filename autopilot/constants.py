"""Numbers that PX4 v1.18 gives names: navigation states, setpoint types, takeoff states."""

from enum import IntEnum
from typing import Final


class NavState(IntEnum):
    """vehicle_status.nav_state (msg/versioned/VehicleStatus.msg)."""

    MANUAL = 0
    ALTCTL = 1
    POSCTL = 2
    AUTO_MISSION = 3
    AUTO_LOITER = 4
    AUTO_RTL = 5
    POSITION_SLOW = 6
    GUIDED_COURSE = 7
    ALTITUDE_CRUISE = 8
    FREE3 = 9
    ACRO = 10
    FREE2 = 11
    DESCEND = 12
    TERMINATION = 13
    OFFBOARD = 14
    STAB = 15
    FREE1 = 16
    AUTO_TAKEOFF = 17
    AUTO_LAND = 18
    AUTO_FOLLOW_TARGET = 19
    AUTO_PRECLAND = 20
    ORBIT = 21
    AUTO_VTOL_TAKEOFF = 22
    EXTERNAL1 = 23
    EXTERNAL2 = 24
    EXTERNAL3 = 25
    EXTERNAL4 = 26
    EXTERNAL5 = 27
    EXTERNAL6 = 28
    EXTERNAL7 = 29
    EXTERNAL8 = 30


class RequestedAction(IntEnum):
    """action_request.action: what a switch or a gesture asks of the commander."""

    DISARM = 0
    ARM = 1
    TOGGLE_ARMING = 2
    UNKILL = 3
    KILL = 4
    SWITCH_MODE = 5
    TERMINATION = 8


class SetpointType(IntEnum):
    """position_setpoint.type."""

    POSITION = 0
    VELOCITY = 1
    LOITER = 2
    TAKEOFF = 3
    LAND = 4
    IDLE = 5


class TakeoffState(IntEnum):
    """takeoff_status.takeoff_state."""

    UNINITIALIZED = 0
    DISARMED = 1
    SPOOLUP = 2
    READY_FOR_TAKEOFF = 3
    RAMPUP = 4
    FLIGHT = 5


class Severity(IntEnum):
    """MAV_SEVERITY, as texts to the ground carry it."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


HEARTBEAT_TIMEOUT_US: Final = 2_500_000
"""So old may the HEARTBEAT of a ground station or a component be for a link to count it (telemetry_status)."""
HEARTBEAT_TOLD_US: Final = 2_360_000
"""So long after it other modules are told of it. A link looks again 1.25 s after a heartbeat, and at 2.5 s finds it too
old (MavlinkReceiver::CheckHeartbeats); it publishes what it knows then and once a second (Mavlink::task_main), for the
last time at 2.36 s: a PX4 v1.18 in real time missed its mission computer 5 s later, 7.35 to 7.39 s after its last
heartbeat, eleven times."""
GEAR_DOWN: Final = -1
GEAR_KEEP: Final = 0
GEAR_UP: Final = 1
"""landing_gear."""
MOST_ROTORS: Final = 12
"""CA_ROTOR_COUNT at most: PX4 has parameters for so many."""
IMU_TEMPERATURE_C: Final = 15.0
"""What SIH's IMU says (T1_C, simulator_sih/sih.hpp)."""
