"""What parameters and their codes mean, in our words: those that act here, and those of a ground station's setup pages.

`{n}` in a name or text is the instance's number. A parameter without a text speaks through its name; codes are only
given meanings when all of a parameter's have one.
"""

import functools
import re
from collections.abc import Mapping
from typing import TypeVar

from autopilot.mavlink.component_metadata.actuators import FUNCTIONS
from sitl_emu.core import dialect as mavlink

SHORT = {
    # commander and failsafes
    "BAT_LOW_THR": "Charge below which the battery is low",
    "BAT_CRIT_THR": "Charge below which the battery is critically low",
    "BAT_EMERGEN_THR": "Charge below which the vehicle lands at once",
    "BAT{n}_N_CELLS": "Cells in series",
    "BAT{n}_V_EMPTY": "Voltage of an empty cell under load",
    "BAT{n}_V_CHARGED": "Voltage of a full cell",
    "BAT{n}_CAPACITY": "Capacity; -1 if not known",
    "BAT{n}_SOURCE": "Where the battery is measured",
    "COM_ARM_BAT_MIN": "Charge needed to arm; -1 for the low threshold",
    "COM_ARM_MIS_REQ": "Arming needs a valid mission",
    "COM_ARM_WO_GPS": "Arming without a global position",
    "COM_DISARM_LAND": "Time from landing to disarming; negative: never",
    "COM_DISARM_PRFLT": "Time to take off after arming before it disarms; negative: never",
    "COM_DLL_EXCEPT": "Modes that go on without a ground station",
    "COM_DL_LOSS_T": "Silence after which the ground station is lost",
    "COM_FAIL_ACT_T": "Hold for so long before a failsafe acts",
    "COM_FLIGHT_UUID": "Number of the next flight",
    "COM_FLT_TIME_MAX": "Longest flight; -1 for no limit",
    "COM_FLTMODE{n}": "Mode of switch position {n}",
    "COM_HOME_EN": "Set the home position",
    "COM_LOW_BAT_ACT": "What a low battery does",
    "COM_OBL_RC_ACT": "What the loss of offboard setpoints does",
    "COM_OF_LOSS_T": "Silence after which offboard setpoints are lost",
    "COM_POS_FS_EPH": "Horizontal error beyond which the position is lost",
    "COM_RCL_EXCEPT": "Modes that go on without manual control",
    "COM_RC_IN_MODE": "Where manual control comes from",
    "COM_RC_LOSS_T": "Silence after which manual control is lost",
    "COM_SPOOLUP_TIME": "Time that motors need to spin up after arming",
    "NAV_DLL_ACT": "What the loss of the ground station does",
    "NAV_RCL_ACT": "What the loss of manual control does",
    "GF_ACTION": "What leaving the geofence does",
    "GF_MAX_HOR_DIST": "Largest distance from home; 0 for no limit",
    "GF_MAX_VER_DIST": "Largest height above home; 0 for no limit",
    "GF_SOURCE": "Position that is compared with the geofence",
    "SYS_FAILURE_EN": "Failures may be injected by command",
    "SYS_AUTOSTART": "Airframe",
    "SYS_AUTOCONFIG": "Reset parameters at the next start",
    "SYS_HAS_GPS": "The vehicle has a GNSS receiver",
    # estimator
    "EKF2_ABIAS_INIT": "Uncertainty of the accelerometer bias at switch-on",
    "EKF2_ABL_LIM": "Largest accelerometer bias",
    "EKF2_ACC_B_NOISE": "How fast the accelerometer bias may change",
    "EKF2_ACC_NOISE": "Accelerometer noise",
    "EKF2_ANGERR_INIT": "Uncertainty of tilt at switch-on",
    "EKF2_BARO_CTRL": "Fuse the barometer",
    "EKF2_BARO_GATE": "Innovation gate of the barometer",
    "EKF2_BARO_NOISE": "Barometer noise",
    "EKF2_DECL_TYPE": "Where magnetic declination comes from",
    "EKF2_GBIAS_INIT": "Uncertainty of the gyroscope bias at switch-on",
    "EKF2_GPS_CHECK": "Checks that GNSS must pass before it is fused",
    "EKF2_GPS_CTRL": "What of GNSS is fused",
    "EKF2_GPS_P_GATE": "Innovation gate of the GNSS position",
    "EKF2_GPS_P_NOISE": "Least noise of the GNSS position",
    "EKF2_GPS_V_GATE": "Innovation gate of the GNSS velocity",
    "EKF2_GPS_V_NOISE": "Least noise of the GNSS velocity",
    "EKF2_GYR_B_LIM": "Largest gyroscope bias",
    "EKF2_GYR_B_NOISE": "How fast the gyroscope bias may change",
    "EKF2_GYR_NOISE": "Gyroscope noise",
    "EKF2_HDG_GATE": "Innovation gate of the heading",
    "EKF2_HGT_REF": "Height reference",
    "EKF2_MAG_DECL": "Magnetic declination",
    "EKF2_MAG_NOISE": "Compass noise",
    "EKF2_MAG_TYPE": "How the compass is fused",
    "EKF2_MIN_RNG": "Range that is measured on the ground",
    "EKF2_NOAID_NOISE": "Noise of the position that is held without aiding",
    "EKF2_NOAID_TOUT": "Time without aiding after which the position is lost",
    "EKF2_REQ_EPH": "Largest horizontal error that GNSS may report",
    "EKF2_REQ_EPV": "Largest vertical error that GNSS may report",
    "EKF2_REQ_FIX": "GNSS fix needed",
    "EKF2_REQ_GPS_H": "Time for which GNSS must pass its checks",
    "EKF2_REQ_NSATS": "Satellites needed",
    "EKF2_RNG_CTRL": "When the range finder helps",
    "EKF2_RNG_GATE": "Innovation gate of the range finder",
    "EKF2_RNG_NOISE": "Range finder noise",
    "EKF2_RNG_SFE": "Range finder noise per metre of range",
    "EKF2_TERR_GRAD": "Slope of the terrain that is expected",
    "EKF2_TERR_NOISE": "How fast the terrain estimate may change",
    "HTE_ACC_GATE": "Innovation gate of the hover thrust estimate",
    "HTE_HT_ERR_INIT": "Uncertainty of hover thrust at takeoff",
    "HTE_HT_NOISE": "How fast hover thrust may change",
    "HTE_THR_RANGE": "How far the estimate may leave MPC_THR_HOVER",
    "HTE_VXY_THR": "Horizontal speed above which the estimate is trusted less",
    "HTE_VZ_THR": "Vertical speed above which the estimate is trusted less",
    "IMU_GYRO_CUTOFF": "Low-pass filter of the angular velocity",
    "IMU_DGYRO_CUTOFF": "Low-pass filter of the angular acceleration",
    "SENS_BARO_QNH": "Air pressure at sea level",
    "LNDMC_ROT_MAX": "Rotation below which the vehicle can have landed",
    "LNDMC_XY_VEL_MAX": "Horizontal speed below which it can have landed",
    "LNDMC_Z_VEL_MAX": "Vertical speed below which it can have landed",
    # actuators
    "PWM_MAIN_FUNC{n}": "What output {n} drives",
    "PWM_MAIN_REV": "Outputs that are reversed",
    "CA_AIRFRAME": "Kind of vehicle",
    "CA_FAILURE_MODE": "What the allocation does when a motor has failed",
    "CA_METHOD": "How the allocation distributes",
    "CA_ROTOR_COUNT": "Number of motors",
    "CA_ROTOR{n}_AX": "Axis of motor {n}, forward",
    "CA_ROTOR{n}_AY": "Axis of motor {n}, right",
    "CA_ROTOR{n}_AZ": "Axis of motor {n}, down",
    "CA_ROTOR{n}_CT": "Thrust coefficient of motor {n}",
    "CA_ROTOR{n}_KM": "Torque per thrust of motor {n}; positive turns counter-clockwise",
    "CA_ROTOR{n}_PX": "Place of motor {n}, forward",
    "CA_ROTOR{n}_PY": "Place of motor {n}, right",
    "CA_ROTOR{n}_PZ": "Place of motor {n}, down",
    "CA_R_REV": "Motors that can turn both ways",
    "CA_R{n}_SLEW": "Shortest time of motor {n} from 0 to full",
    "CA_SV{n}_SLEW": "Shortest time of servo {n} from end to end",
    "THR_MDL_FAC": "Share of thrust that grows with the square of the signal",
    "MC_AIRMODE": "Keep attitude control at zero throttle",
    "PD_GRIPPER_TO": "Time that the gripper needs to open or close",
    "PD_GRIPPER_TYPE": "Kind of gripper",
    # MAVLink
    "MAV_SYS_ID": "System id",
    "MAV_COMP_ID": "Component id",
    "MAV_TYPE": "Vehicle type that HEARTBEAT says",
    "MAV_HB_FORW_EN": "Forward the heartbeats of others",
    "MAV_HASH_CHK_EN": "Send a hash of all parameters first",
    # navigation
    "MAN_DEADZONE": "Stick deflection that counts as none",
    "MIS_TAKEOFF_ALT": "Height of a takeoff that names none",
    "MIS_TKO_LAND_REQ": "What a mission must contain",
    "MIS_YAW_ERR": "Heading error at which a waypoint is reached",
    "MIS_YAW_TMT": "Time to turn at a waypoint; negative: no limit",
    "MPC_YAW_MODE": "Heading on the way",
    "NAV_ACC_RAD": "Acceptance radius",
    "NAV_LOITER_RAD": "Radius of loitering (fixed wing)",
    "NAV_MC_ALT_RAD": "Acceptance radius in height (multicopter)",
    "MC_ORBIT_RAD_MAX": "Largest radius of an orbit",
    "MC_ORBIT_YAW_MOD": "Heading in an orbit",
    "RTL_CONE_ANG": "Half angle of the cone around home below which the climb of a return is shortened",
    "RTL_DESCEND_ALT": "Height above home at which a return stops descending",
    "RTL_LAND_DELAY": "Wait there before landing; negative: stay",
    "RTL_MIN_DIST": "Distance from home within which a return climbs less",
    "RTL_RETURN_ALT": "Height above home of a return",
    "RTL_TYPE": "Where and how to return",
    # multicopter
    "MC_ACRO_P_MAX": "Pitch rate at full stick in Acro",
    "MC_ACRO_R_MAX": "Roll rate at full stick in Acro",
    "MC_ACRO_Y_MAX": "Yaw rate at full stick in Acro",
    "MC_PITCHRATE_MAX": "Largest pitch rate",
    "MC_ROLLRATE_MAX": "Largest roll rate",
    "MC_YAWRATE_MAX": "Largest yaw rate",
    "MC_PITCH_P": "Pitch error to pitch rate",
    "MC_ROLL_P": "Roll error to roll rate",
    "MC_YAW_P": "Yaw error to yaw rate",
    "MC_YAW_WEIGHT": "Weight of yaw beside roll and pitch",
    "MPC_YAWRAUTO_ACC": "Largest yaw acceleration in automatic modes",
    "MPC_YAWRAUTO_MAX": "Largest yaw rate in automatic modes",
    "MC_PITCHRATE_D": "Pitch rate control, differential gain",
    "MC_PITCHRATE_FF": "Pitch rate control, feedforward",
    "MC_PITCHRATE_I": "Pitch rate control, integral gain",
    "MC_PITCHRATE_K": "Pitch rate control, gain of the whole",
    "MC_PITCHRATE_P": "Pitch rate control, proportional gain",
    "MC_PR_INT_LIM": "Pitch rate control, limit of the integral",
    "MC_ROLLRATE_D": "Roll rate control, differential gain",
    "MC_ROLLRATE_FF": "Roll rate control, feedforward",
    "MC_ROLLRATE_I": "Roll rate control, integral gain",
    "MC_ROLLRATE_K": "Roll rate control, gain of the whole",
    "MC_ROLLRATE_P": "Roll rate control, proportional gain",
    "MC_RR_INT_LIM": "Roll rate control, limit of the integral",
    "MC_YAWRATE_D": "Yaw rate control, differential gain",
    "MC_YAWRATE_FF": "Yaw rate control, feedforward",
    "MC_YAWRATE_I": "Yaw rate control, integral gain",
    "MC_YAWRATE_K": "Yaw rate control, gain of the whole",
    "MC_YAWRATE_P": "Yaw rate control, proportional gain",
    "MC_YR_INT_LIM": "Yaw rate control, limit of the integral",
    "MC_YAW_TQ_CUTOFF": "Low-pass filter of the yaw torque",
    "MC_MAN_TILT_TAU": "How smoothly the sticks tilt",
    "MPC_ACC_DECOUPLE": "Tilt for horizontal acceleration alone",
    "MPC_ACC_DOWN_MAX": "Largest acceleration downwards",
    "MPC_ACC_HOR": "Horizontal acceleration in automatic modes",
    "MPC_ACC_HOR_MAX": "Largest horizontal acceleration",
    "MPC_ACC_UP_MAX": "Largest acceleration upwards",
    "MPC_JERK_AUTO": "Jerk in automatic modes",
    "MPC_JERK_MAX": "Largest jerk in manual modes",
    "MPC_LAND_ALT1": "Height above ground at which landing slows down",
    "MPC_LAND_ALT2": "Height above ground at which it has reached its landing speed",
    "MPC_LAND_ALT3": "Height above ground at which it begins to crawl",
    "MPC_LAND_CRWL": "Crawling speed of a landing",
    "MPC_LAND_SPEED": "Landing speed",
    "MPC_MANTHR_MIN": "Least thrust in Stabilized",
    "MPC_MAN_TILT_MAX": "Tilt at full stick",
    "MPC_MAN_Y_MAX": "Yaw rate at full stick",
    "MPC_MAN_Y_TAU": "How smoothly the yaw stick acts",
    "MPC_POS_MODE": "How the sticks act in Position mode",
    "MPC_THR_HOVER": "Thrust at hover",
    "MPC_THR_MAX": "Largest thrust",
    "MPC_THR_MIN": "Least thrust",
    "MPC_THR_XY_MARG": "Thrust kept for horizontal control",
    "MPC_TILTMAX_AIR": "Largest tilt in flight",
    "MPC_TILTMAX_LND": "Largest tilt when landing",
    "MPC_TKO_RAMP_T": "Time in which thrust rises at takeoff",
    "MPC_TKO_SPEED": "Takeoff speed",
    "MPC_VELD_LP": "Low-pass filter of the acceleration",
    "MPC_VEL_MANUAL": "Speed at full stick",
    "MPC_VEL_MAN_BACK": "Speed backwards at full stick; negative: as forwards",
    "MPC_VEL_MAN_SIDE": "Speed sideways at full stick; negative: as forwards",
    "MPC_XY_CRUISE": "Speed in automatic modes",
    "MPC_XY_ERR_MAX": "Horizontal error beyond which the way waits",
    "MPC_XY_P": "Horizontal position error to velocity",
    "MPC_XY_TRAJ_P": "Distance to the waypoint to speed",
    "MPC_XY_VEL_D_ACC": "Horizontal velocity control, differential gain",
    "MPC_XY_VEL_I_ACC": "Horizontal velocity control, integral gain",
    "MPC_XY_VEL_P_ACC": "Horizontal velocity control, proportional gain",
    "MPC_XY_VEL_MAX": "Largest horizontal speed",
    "MPC_Z_P": "Height error to velocity",
    "MPC_Z_VEL_D_ACC": "Vertical velocity control, differential gain",
    "MPC_Z_VEL_I_ACC": "Vertical velocity control, integral gain",
    "MPC_Z_VEL_P_ACC": "Vertical velocity control, proportional gain",
    "MPC_Z_VEL_MAX_DN": "Largest speed downwards",
    "MPC_Z_VEL_MAX_UP": "Largest speed upwards",
    "MPC_Z_V_AUTO_DN": "Speed downwards in automatic modes",
    "MPC_Z_V_AUTO_UP": "Speed upwards in automatic modes",
    # rover
    "PP_LOOKAHD_GAIN": "Look-ahead distance per speed",
    "PP_LOOKAHD_MAX": "Largest look-ahead distance",
    "PP_LOOKAHD_MIN": "Least look-ahead distance",
    "RA_ACC_RAD_GAIN": "Scale of the acceptance radius at corners",
    "RA_ACC_RAD_MAX": "Largest acceptance radius at corners",
    "RA_MAX_STR_ANG": "Largest steering angle",
    "RA_STR_RATE_LIM": "Largest steering rate",
    "RA_WHEEL_BASE": "Wheel base",
    "RO_YAW_P": "Heading error to yaw rate",
    "RO_YAW_ACCEL_LIM": "Largest yaw acceleration",
    "RO_YAW_DECEL_LIM": "Largest yaw deceleration",
    "RO_YAW_EXPO": "Curve of the steering stick",
    "RO_YAW_SUPEXPO": "Curve of the steering stick near its ends",
    "RO_YAW_STICK_DZ": "Deflection of the steering stick that counts as none",
    "RO_YAW_RATE_CORR": "Scale of the yaw rate feedforward",
    "RO_YAW_RATE_I": "Yaw rate control, integral gain",
    "RO_YAW_RATE_P": "Yaw rate control, proportional gain",
    "RO_YAW_RATE_LIM": "Largest yaw rate",
    "RO_YAW_RATE_TH": "Yaw rate that counts as none",
    "RO_ACCEL_LIM": "Largest acceleration",
    "RO_DECEL_LIM": "Largest deceleration",
    "RO_JERK_LIM": "Largest jerk",
    "RO_MAX_THR_SPEED": "Speed at full throttle",
    "RO_SPEED_I": "Speed control, integral gain",
    "RO_SPEED_P": "Speed control, proportional gain",
    "RO_SPEED_LIM": "Largest speed",
    "RO_SPEED_RED": "How much a heading error slows down",
    "RO_SPEED_TH": "Speed that counts as none",
    # logging
    "SDLOG_MODE": "When logs are written",
    "SDLOG_PROFILE": "What logs contain",
}
"""By name."""

OFF_ON = {0: "Disabled", 1: "Enabled"}
_PRIORITY = {-1: "Uninitialised", 0: "Disabled", 1: "Min", 25: "Low", 50: "Medium", 75: "High", 100: "Max"}
_CHANNELS = {0: "Unassigned"} | {number: f"Channel {number}" for number in range(1, 19)}
_FLIGHT_MODES = {
    -1: "Unassigned",
    0: "Manual",
    1: "Altitude",
    2: "Position",
    3: "Mission",
    4: "Hold",
    5: "Return",
    6: "Acro",
    7: "Offboard",
    8: "Stabilized",
    9: "Position Slow",
    10: "Takeoff",
    11: "Land",
    12: "Follow Me",
    13: "Precision Land",
    16: "Altitude Cruise",
} | {100 + number: f"External Mode {number + 1}" for number in range(8)}
_MANUAL_EXCEPTIONS = {0: "Mission", 1: "Hold", 2: "Offboard", 3: "External modes", 4: "Altitude Cruise"}

VALUES: dict[str, dict[int, str]] = {
    "BAT{n}_N_CELLS": {0: "Unknown"} | {number: f"{number}S" for number in range(1, 17)},
    "BAT{n}_SOURCE": {-1: "None", 0: "Power module", 1: "External", 2: "ESCs"},
    "CA_AIRFRAME": {
        0: "Multirotor",
        1: "Fixed wing",
        2: "Standard VTOL",
        3: "Tiltrotor VTOL",
        4: "Tailsitter VTOL",
        5: "Rover (Ackermann)",
        6: "Rover (Differential)",
        7: "Motors (6DOF)",
        8: "Multirotor with tilt",
        9: "Custom",
        10: "Helicopter (tail ESC)",
        11: "Helicopter (tail servo)",
        12: "Helicopter (coaxial)",
        13: "Rover (Mecanum)",
        14: "Spacecraft 2D",
        15: "Spacecraft 3D",
    },
    "CA_FAILURE_MODE": {0: "Ignore", 1: "Leave the first failed motor out"},
    "CA_METHOD": {0: "Pseudo-inverse, clipped", 1: "Pseudo-inverse, desaturated in turn", 2: "Automatic"},
    "CA_ROTOR_COUNT": {number: str(number) for number in range(13)},
    "COM_ARM_WO_GPS": {0: "Denied", 1: "Allowed, with a warning", 2: "Allowed"},
    "COM_ARM_MIS_REQ": OFF_ON,
    "COM_FLTMODE{n}": _FLIGHT_MODES,
    "COM_HOME_EN": OFF_ON,
    "COM_HOME_IN_AIR": OFF_ON,
    "COM_LOW_BAT_ACT": {0: "Warning", 2: "Land", 3: "Return when critical, land when empty"},
    "COM_OBL_RC_ACT": {
        0: "Position",
        1: "Altitude",
        2: "Stabilized",
        3: "Return",
        4: "Land",
        5: "Hold",
        6: "Terminate",
        7: "Disarm",
    },
    "COM_RC_IN_MODE": {
        0: "Radio control only",
        1: "MAVLink only",
        2: "Either; another when the first is lost",
        3: "Either; the first until reboot",
        4: "None",
        5: "Radio control before MAVLink, lower instances first",
        6: "MAVLink before radio control, lower instances first",
        7: "Radio control before MAVLink, higher instances first",
        8: "MAVLink before radio control, higher instances first",
    },
    "GF_ACTION": {0: "Nothing", 1: "Warning", 2: "Hold", 3: "Return", 4: "Terminate", 5: "Land"},
    "GF_SOURCE": {0: "Estimate", 1: "GNSS"},
    "NAV_DLL_ACT": {0: "Nothing", 1: "Hold", 2: "Return", 3: "Land", 5: "Terminate", 6: "Disarm"},
    "NAV_RCL_ACT": {1: "Hold", 2: "Return", 3: "Land", 5: "Terminate", 6: "Disarm", 7: "Nothing"},
    "EKF2_HGT_REF": {0: "Barometer", 1: "GNSS", 2: "Range finder", 3: "Vision"},
    "EKF2_MAG_TYPE": {0: "Automatic", 1: "Heading only", 5: "Never", 6: "At first only"},
    "EKF2_RNG_CTRL": {0: "Never", 1: "When low and slow", 2: "Always"},
    "EKF2_REQ_FIX": {
        0: "None",
        2: "2D",
        3: "3D",
        4: "Differential",
        5: "RTK float",
        6: "RTK fixed",
        8: "Extrapolated",
    },
    "EKF2_GPS_MODE": {0: "Automatic", 1: "Dead reckoning"},
    "MAV_PROTO_VER": {1: "MAVLink 1", 2: "MAVLink 2"},
    "MAV_HASH_CHK_EN": OFF_ON,
    "MC_AIRMODE": {0: "Disabled", 1: "Roll and pitch", 2: "Roll, pitch and yaw"},
    "MC_ORBIT_YAW_MOD": {
        0: "To the centre",
        1: "As it was",
        2: "Free",
        3: "Along the circle",
        4: "By the stick",
    },
    "MIS_TKO_LAND_REQ": {
        0: "Nothing",
        1: "A takeoff",
        2: "A landing",
        3: "A takeoff and a landing",
        4: "Both or neither",
        5: "Both or neither; in the air a landing is enough",
    },
    "MPC_ACC_DECOUPLE": OFF_ON,
    "MPC_POS_MODE": {0: "Sticks are velocity", 4: "Sticks are acceleration"},
    "MPC_YAW_MODE": {
        0: "To the waypoint",
        1: "To home",
        2: "Away from home",
        3: "Along the way",
        4: "To the waypoint, then along the way",
        5: "By the pilot",
    },
    "PD_GRIPPER_TYPE": {-1: "None", 0: "Servo"},
    "PWM_MAIN_FUNC{n}": FUNCTIONS,
    "RTL_TYPE": {
        0: "Home or a rally point, directly",
        1: "The mission's landing or a rally point, directly",
        2: "The mission's landing along the mission, or home back along it",
        3: "Whichever of home, rally points and the mission's landing is nearest",
        4: "The mission's landing or back along it to home, whichever is nearer",
        5: "The nearest rally point; home if there is none",
    },
    "SDLOG_MODE": {
        0: "Armed",
        1: "From switch-on until disarmed",
        2: "From switch-on until shutdown",
        3: "By a switch of the transmitter",
        4: "From the first arming until shutdown",
    },
    "SIH_VEHICLE_TYPE": {
        0: "Quadrotor",
        1: "Fixed wing",
        2: "Tailsitter",
        3: "Standard VTOL",
        4: "Hexacopter",
        5: "Rover (Ackermann)",
    },
    "SYS_AUTOCONFIG": {0: "Keep parameters", 1: "Reset parameters"},
    "SYS_HAS_GPS": OFF_ON,
    "SYS_HAS_BARO": OFF_ON,
}
"""Meanings of codes, by name."""

BITS: dict[str, dict[int, str]] = {
    "COM_DLL_EXCEPT": _MANUAL_EXCEPTIONS,
    "COM_RCL_EXCEPT": _MANUAL_EXCEPTIONS,
    "EKF2_GPS_CTRL": {0: "Position", 1: "Altitude", 2: "Velocity", 3: "Heading of two antennas"},
    "EKF2_DECL_TYPE": {0: "Of the GNSS position", 1: "Save what was learnt"},
    "PWM_MAIN_REV": {bit: f"Channel {bit + 1}" for bit in range(16)},
}
"""Meanings of bits, by name."""

Text = TypeVar("Text", str, dict[int, str])
_INSTANCE = re.compile(r"\d+")


def short(name: str) -> str:
    """A line on a parameter; empty if its name must do."""
    return _found(SHORT, name) or ""


def values(name: str) -> dict[int, str]:
    """What a parameter's codes mean."""
    if name == "MAV_TYPE":
        return _enum("MAV_TYPE", "MAV_TYPE_")
    if name.startswith(("CAL_", "SENS_")) and name.endswith("_ROT"):
        return {-1: "Internal"} | _enum("MAV_SENSOR_ORIENTATION", "MAV_SENSOR_ROTATION_") | {100: "Custom angles"}
    if name.startswith("CAL_") and name.endswith("_PRIO"):
        return _PRIORITY
    if name.startswith("RC_MAP_"):
        return _CHANNELS
    meanings = _found(VALUES, name)
    if meanings is None and name.endswith("_EN"):
        return OFF_ON
    return meanings or {}


def bits(name: str) -> dict[int, str]:
    """What a parameter's bits mean."""
    return _found(BITS, name) or {}


def _found(table: Mapping[str, Text], name: str) -> Text | None:
    """The entry of a name, or of all its instances; a text's `{n}` is filled in."""
    if name in table:
        return table[name]
    for number in _INSTANCE.finditer(name):
        found = table.get(f"{name[: number.start()]}{{n}}{name[number.end() :]}")
        if found is not None:
            return found.replace("{n}", number[0]) if isinstance(found, str) else found
    return None


@functools.cache
def _enum(name: str, prefix: str) -> dict[int, str]:
    """A MAVLink enum, its entries as words."""
    entries = mavlink.enums[name].items()
    return {code: entry.name.removeprefix(prefix).replace("_", " ").capitalize() for code, entry in entries}
