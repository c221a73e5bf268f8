"""What the codes and bits of parameters mean, in our words; given only when all of a parameter's have a meaning."""

import functools

from sitl_emu.autopilot.mavlink.component_metadata.actuators import FUNCTIONS
from sitl_emu.autopilot.mavlink.component_metadata.parameter_texts import found
from sitl_emu.core import dialect as mavlink

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

_AUXILIARIES = {0: "Unassigned"} | {number: f"AUX {number}" for number in range(1, 7)}
_ACTIONS = {0: "Nothing", 1: "Warning", 2: "Hold", 3: "Return", 4: "Terminate", 5: "Land"}
_SWITCHES = (
    *("COM_ARMABLE", "COM_ARM_AUTH_REQ", "COM_ARM_CHK_ESCS", "COM_ARM_HFLT_CHK", "COM_ARM_ON_BOOT", "COM_ARM_SWISBTN"),
    *("COM_FORCE_SAFETY", "COM_MODE_ARM_CHK", "CP_GO_NO_DATA", "EKF2_BARO_CTRL", "EKF2_DRAG_CTRL", "EKF2_FUSE_BETA"),
    *("EKF2_LOG_VERBOSE", "EKF2_OF_CTRL", "EKF2_POS_LOCK", "EKF2_RNGBC_CTRL", "EKF2_SYNT_MAG_Z", "MAN_ARM_GESTURE"),
    *("MAV_FWDEXTSP", "MAV_USEHILGPS", "MIS_MNT_YAW_CTL", "NAV_FORCE_VT", "NAV_LTR_LAST_DL", "RTL_APPR_FORCE"),
    *("SDLOG_BOOT_BAT", "SDLOG_UUID", "SENS_BAR_AUTOCAL", "SENS_EN_AGPSIM", "SENS_EN_BAROSIM", "SENS_EN_GPSSIM"),
    *("SENS_EN_MAGSIM", "SENS_IMU_AUTOCAL", "SENS_IMU_CLPNOTI", "SENS_MAG_AUTOCAL", "SENS_MAG_AUTOROT"),
)

VALUES: dict[str, dict[int, str]] = {
    **dict.fromkeys(_SWITCHES, OFF_ON),
    "CAL_AIR_CMODEL": {0: "With Pitot tube", 1: "Without Pitot tube", 2: "Pressure drop in the tube"},
    "CAL_MAG_COMP_TYP": {0: "Nothing", 1: "Throttle", 2: "Current of battery 1", 3: "Current of battery 2"},
    "COM_ACT_FAIL_ACT": {0: "Warning", 1: "Hold", 2: "Land", 3: "Return", 4: "Terminate"},
    "COM_ARM_AUTH_MET": {0: "In one step", 1: "In two steps"},
    "COM_ARM_MAG_STR": {0: "Nothing", 1: "Arming is denied", 2: "Warning"},
    "COM_FLTMODE_BOOT": {
        0: "Manual",
        1: "Altitude",
        2: "Position",
        3: "Mission",
        4: "Hold",
        6: "Position Slow",
        8: "Altitude Cruise",
        10: "Acro",
        14: "Offboard",
        15: "Stabilized",
        17: "Takeoff",
        **{23 + number: f"External Mode {number + 1}" for number in range(8)},
    },
    "COM_FLTT_LOW_ACT": {0: "Nothing", 1: "Warning", 3: "Return"},
    "COM_POS_LOW_ACT": _ACTIONS,
    "COM_PREARM_MODE": {0: "Never", 1: "After the safety button", 2: "Always"},
    "COM_QC_ACT": {-1: "Warning", 0: "Return", 1: "Land", 2: "Hold"},
    "COM_WIND_MAX_ACT": _ACTIONS,
    "EKF2_EV_NOISE_MD": {0: "As it is reported", 1: "As the parameters say"},
    "EKF2_OF_GYR_SRC": {0: "Automatic", 1: "Internal"},
    "FLW_TGT_ALT_M": {0: "Above home", 1: "Above the terrain", 2: "Above the one who is followed"},
    "IMU_GYRO_RATEMAX": {rate: f"{rate} Hz" for rate in (100, 250, 400, 800, 1000, 2000)},
    "IMU_INTEG_RATE": {rate: f"{rate} Hz" for rate in (100, 200, 250, 400)},
    "MC_AT_APPLY": {0: "Never", 1: "After disarming", 2: "In flight"},
    "MC_SLOW_MAP_HVEL": _AUXILIARIES,
    "MC_SLOW_MAP_PTCH": _AUXILIARIES,
    "MC_SLOW_MAP_VVEL": _AUXILIARIES,
    "MC_SLOW_MAP_YAWR": _AUXILIARIES,
    "MPC_ALT_MODE": {0: "Altitude", 1: "Height above ground", 2: "Height above ground when slow"},
    "MPC_THR_CURVE": {0: "Estimated hover thrust", 1: "Half thrust", 2: "MPC_THR_HOVER"},
    "NAV_TRAFF_AVOID": {0: "Nothing", 1: "Warning", 2: "Return", 3: "Land", 4: "Hold"},
    "RTL_CONE_ANG": {0: "No cone"} | {angle: f"{angle}°" for angle in (25, 45, 65, 80, 90)},
    "RTL_PLD_MD": {0: "No precision landing", 1: "If the target is seen", 2: "Wait for the target"},
    "SDLOG_MISSION": {0: "None", 1: "All of the mission", 2: "For geotagging"},
    "SENS_IMU_MODE": {0: "All", 1: "The primary"},
    "SENS_MAG_MODE": {0: "All", 1: "The primary"},
    "SENS_MAG_SIDES": {34: "Two", 38: "Three", 63: "Six"},
    "SYS_FAC_CAL_MODE": {0: "Disabled", 1: "All sensors", 2: "All but the compass"},
    "SYS_HITL": {-1: "An external one", 0: "None", 1: "Hardware in the loop", 2: "PX4's own (SIH)"},
    "TRIG_INTERFACE": {1: "GPIO", 2: "Seagull MAP2", 3: "MAVLink", 4: "PWM"},
    "TRIG_MODE": {
        0: "Off",
        1: "By time, when commanded",
        2: "By time, always",
        3: "By distance, always",
        4: "By distance, when commanded",
    },
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
    "COM_ARM_ODID": {
        0: "Nothing",
        1: "Warning",
        2: "Arming is denied",
        3: "Arming is denied, return",
        4: "Arming is denied, land",
        5: "Arming is denied, terminate",
    },
    "COM_ARM_TRAFF": {
        0: "Nothing",
        1: "Warning",
        2: "Arming is denied",
        3: "Arming is denied in mission modes",
    },
    "COM_GNSSLOSS_ACT": {0: "Warning", 1: "Return", 2: "Land", 3: "Terminate"},
    "COM_PARACHUTE": {
        0: "Nothing",
        1: "Warning",
        2: "Arming is denied",
        3: "Arming is denied, return",
        4: "Arming is denied, land",
    },
    "MNT_DO_STAB": {0: "Off", 1: "All axes", 2: "Yaw where it is locked", 3: "Pitch where it is locked"},
    **dict.fromkeys(("MNT_MAN_PITCH", "MNT_MAN_ROLL", "MNT_MAN_YAW"), _AUXILIARIES),
    "MNT_MODE_IN": {
        -1: "Disabled",
        0: "Radio and MAVLink protocol 2",
        1: "Radio",
        2: "MAVLink protocol 1, regions of interest",
        3: "MAVLink protocol 1, mount commands",
        4: "MAVLink protocol 2",
        5: "Fixed",
    },
    "MNT_MODE_OUT": {0: "Servo outputs", 1: "MAVLink protocol 1", 2: "MAVLink protocol 2"},
    "MNT_RC_IN_MODE": {0: "Angles", 1: "Rates"},
    "TRIG_POLARITY": {0: "Active low", 1: "Active high"},
    "SYS_AUTOCONFIG": {0: "Keep parameters", 1: "Reset parameters"},
    "SYS_HAS_GPS": OFF_ON,
    "SYS_HAS_BARO": OFF_ON,
}
"""Meanings of codes, by name."""

BITS: dict[str, dict[int, str]] = {
    "CA_R_REV": {bit: f"Motor {bit + 1}" for bit in range(12)},
    "EKF2_EV_CTRL": {0: "Horizontal position", 1: "Vertical position", 2: "Velocity", 3: "Heading"},
    "EKF2_IMU_CTRL": {0: "Gyroscope bias", 1: "Accelerometer bias", 2: "Gravity"},
    "EKF2_MAG_CHECK": {0: "Strength", 1: "Inclination", 2: "Wait for the place"},
    "EKF2_GPS_CHECK": {
        0: "Satellites",
        1: "PDOP",
        2: "Horizontal accuracy",
        3: "Vertical accuracy",
        4: "Speed accuracy",
        5: "Horizontal drift",
        6: "Vertical drift",
        7: "Horizontal speed at rest",
        8: "Vertical speed at rest",
        9: "Spoofing",
        10: "Kind of fix",
        11: "Jamming",
    },
    "EKF2_SENS_EN": {
        0: "GNSS receiver 1",
        1: "GNSS receiver 2",
        2: "Optical flow",
        3: "External vision",
        **{4 + slot: f"Auxiliary position {slot}" for slot in range(4)},
        8: "Barometer",
        9: "Range finder",
        10: "Compass",
        11: "Airspeed",
        12: "Ranging beacons",
    },
    "MPC_AUTO_NUDGING": {0: "Yaw", 1: "Place of a landing"},
    "VTE_AID_MASK": {
        0: "GNSS position of the target",
        1: "GNSS velocity of the vehicle",
        2: "Vision",
        3: "Landing point of the mission",
        4: "GNSS velocity of the target",
    },
    "VTE_TASK_MASK": {0: "Precision landing", 1: "Always, for tests"},
    "IMU_GYRO_DNF_EN": {0: "Motor speeds", 1: "FFT"},
    "RC_MAP_FLTM_BTN": {bit: f"Channel {bit + 1}" for bit in range(18)},
    "SDLOG_BACKEND": {0: "Card", 1: "MAVLink"},
    "SDLOG_PROFILE": {
        0: "Default",
        1: "Estimator replay",
        2: "Thermal calibration",
        3: "System identification",
        4: "High rate",
        5: "Debug",
        6: "Sensor comparison",
        7: "Vision and avoidance",
        8: "Raw gyroscope",
        9: "Raw accelerometer",
        10: "MAVLink tunnel",
        11: "High-rate sensors",
    },
    "SENS_GPS_MASK": {0: "Speed accuracy", 1: "Horizontal accuracy", 2: "Vertical accuracy"},
    "COM_DLL_EXCEPT": _MANUAL_EXCEPTIONS,
    "COM_RCL_EXCEPT": _MANUAL_EXCEPTIONS,
    "EKF2_GPS_CTRL": {0: "Position", 1: "Altitude", 2: "Velocity", 3: "Heading of two antennas"},
    "EKF2_DECL_TYPE": {0: "Of the GNSS position", 1: "Save what was learnt"},
    "PWM_MAIN_REV": {bit: f"Channel {bit + 1}" for bit in range(16)},
}
"""Meanings of bits, by name."""


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
    meanings, _ = found(VALUES, name)
    if meanings is None and name.endswith("_EN"):
        return OFF_ON
    return meanings or {}


def bits(name: str) -> dict[int, str]:
    """What a parameter's bits mean."""
    meanings, _ = found(BITS, name)
    return meanings or {}


@functools.cache
def _enum(name: str, prefix: str) -> dict[int, str]:
    """A MAVLink enum, its entries as words."""
    entries = mavlink.enums[name].items()
    return {code: entry.name.removeprefix(prefix).replace("_", " ").capitalize() for code, entry in entries}
