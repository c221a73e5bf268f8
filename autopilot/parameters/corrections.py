"""Parameters without sense that PX4's modules set right by themselves (v1.18), outside the position controller.

Each row is a module that looks for changed parameters once a second and what it corrects then. What it corrects
without a notification (param_set_no_notification) is told with the next change of another parameter.
"""

from collections.abc import Callable
from typing import NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.parameters.subscription_interval import PARAMETER_UPDATE_INTERVAL_US, SubscriptionInterval
from sitl_emu.autopilot.vehicle_kind import Traits

MAV_TYPES = 50
"""PX4's MAV_TYPE_ENUM_END (Mavlink::mavlink_update_parameters); our dialect's is older by one."""
WITH_YAW = 2
"""MC_AIRMODE."""
MAG_FUSE_TYPES = (0, 1, 5, 6)
"""EKF2_MAG_TYPE: automatic, heading, none, at the start alone (EKF2.cpp, MagFuseType)."""
SENSOR_DELAYS = (
    "EKF2_AVEL_DELAY",
    "EKF2_BARO_DELAY",
    "EKF2_ASP_DELAY",
    "EKF2_MAG_DELAY",
    "EKF2_RNG_DELAY",
    "SENS_GPS0_DELAY",
    "SENS_GPS1_DELAY",
    "EKF2_OF_DELAY",
    "EKF2_EV_DELAY",
)
"""What EKF2_DELAY_MAX has to reach (EKF2.cpp, VerifyParams)."""
CRAWL_SPEED_MARGIN = 1.2
"""MulticopterLandDetector::_update_params: MPC_LAND_CRWL and MPC_LAND_SPEED are so much faster than LNDMC_Z_VEL_MAX."""


UNKNOWN_PRIORITY, MOST_PRIORITY = -1, 100
"""CAL_…_PRIO (lib/sensor_calibration): PX4's default, and the most."""


class Correction(NamedTuple):
    """A module, the parameter that it may correct, what it makes of it, and whether it notifies others."""

    module: str
    name: str
    corrected: Callable[[Parameters], Value]
    notifies: bool
    text: str = ""
    """What the ground is told of it, where it is."""
    event: str = ""
    tells: int = 0
    """How much the event has of the value that was wrong and the one that it became."""
    severity: Severity = Severity.CRITICAL
    line: str = ""
    """What the log alone is told of it: a format of both values."""


def _land_detector_speed(parameters: Parameters) -> float:
    most = min(float(parameters["MPC_LAND_CRWL"]), float(parameters["MPC_LAND_SPEED"])) / CRAWL_SPEED_MARGIN
    return min(float(parameters["LNDMC_Z_VEL_MAX"]), most)


def _integration_rate(parameters: Parameters) -> int:
    return max(50, min(1000, int(parameters["IMU_INTEG_RATE"])))


def _gyro_rate(parameters: Parameters) -> int:
    rate = int(parameters["IMU_GYRO_RATEMAX"])
    return max(50, min(10_000, rate if rate > 0 else int(parameters.default("IMU_GYRO_RATEMAX"))))


def _priority(name: str) -> Callable[[Parameters], int]:
    def corrected(parameters: Parameters) -> int:
        value = int(parameters[name])
        return value if UNKNOWN_PRIORITY <= value <= MOST_PRIORITY else UNKNOWN_PRIORITY

    return corrected


def _mag_type(parameters: Parameters) -> int:
    kind = int(parameters["EKF2_MAG_TYPE"])
    return kind if kind in MAG_FUSE_TYPES else 0


def _largest_delay(parameters: Parameters) -> float:
    return max(float(parameters[name]) for name in ("EKF2_DELAY_MAX", *SENSOR_DELAYS))


def _vehicle_type(parameters: Parameters) -> int:
    kind = int(parameters["MAV_TYPE"])
    return kind if 0 <= kind < MAV_TYPES else 0


def _arm_gesture(parameters: Parameters) -> int:
    """Sticks do not arm where a switch does."""
    gesture = int(parameters["MAN_ARM_GESTURE"])
    return 0 if gesture == 1 and int(parameters["RC_MAP_ARM_SW"]) > 0 else gesture


def _air_mode(parameters: Parameters) -> int:
    """No yaw in it where the yaw stick, held aside, arms."""
    air_mode = int(parameters["MC_AIRMODE"])
    return 1 if air_mode == WITH_YAW and int(parameters["MAN_ARM_GESTURE"]) == 1 else air_mode


EVERYWHERE = (
    Correction("vehicle_imu", "IMU_INTEG_RATE", _integration_rate, False),
    Correction("vehicle_angular_velocity", "IMU_GYRO_RATEMAX", _gyro_rate, False),
    Correction("vehicle_imu", "CAL_ACC0_PRIO", _priority("CAL_ACC0_PRIO"), False),
    Correction("vehicle_imu", "CAL_GYRO0_PRIO", _priority("CAL_GYRO0_PRIO"), False),
    Correction("vehicle_air_data", "CAL_BARO0_PRIO", _priority("CAL_BARO0_PRIO"), False),
    Correction("vehicle_magnetometer", "CAL_MAG0_PRIO", _priority("CAL_MAG0_PRIO"), False),
    Correction("vehicle_magnetometer", "CAL_MAG_SIDES", lambda parameters: parameters["SENS_MAG_SIDES"], True),
    Correction(
        "ekf2",
        "EKF2_MAG_TYPE",
        _mag_type,
        True,
        text="EKF2_MAG_TYPE invalid, resetting to default",
        event="ekf2_mag_type_invalid",
        tells=1,
    ),
    Correction(
        "ekf2",
        "EKF2_DELAY_MAX",
        _largest_delay,
        False,
        event="nf_delay_max_too_small",
        tells=2,
        severity=Severity.WARNING,
    ),
    Correction("mavlink", "MAV_TYPE", _vehicle_type, False),
    Correction(
        "manual_control",
        "MAN_ARM_GESTURE",
        _arm_gesture,
        True,
        text="Arm stick gesture disabled if arm switch in use\t",
        event="stick_gesture_disabled_by_arm_switch",
    ),
)
OF_MULTICOPTERS = (
    Correction(
        "land_detector",
        "LNDMC_Z_VEL_MAX",
        _land_detector_speed,
        False,
        line="LNDMC_Z_VEL_MAX > MPC_LAND_CRWL or MPC_LAND_SPEED, updating {:.3f} -> {:.3f}",
    ),
    Correction(
        "manual_control",
        "MC_AIRMODE",
        _air_mode,
        True,
        text="Yaw Airmode requires disabling the stick arm gesture\t",
        event="commander_airmode_requires_no_arm_gesture",
    ),
)


class ParameterCorrections:
    """The modules of one vehicle that correct parameters."""

    def __init__(self, parameters: Parameters, texts: Texts, traits: Traits) -> None:
        """`texts`: where the modules tell the ground."""
        self._parameters, self._texts = parameters, texts
        self._corrections = EVERYWHERE + (OF_MULTICOPTERS if traits.land_detector == "multicopter" else ())
        self._updates = SubscriptionInterval(PARAMETER_UPDATE_INTERVAL_US, parameters.notifications)
        self._correct()

    def update(self, now_us: int) -> None:
        """Look for changed parameters."""
        if self._updates.updated(now_us, self._parameters.notifications):
            self._correct()

    def _correct(self) -> None:
        parameters = self._parameters
        for correction in self._corrections:
            name = correction.name
            value, before = correction.corrected(parameters), parameters[name]
            if value == before:
                continue
            if correction.event:
                told = (float(before), float(value))[: correction.tells]
                self._texts.say(correction.severity, correction.text, correction.event, *told, module=correction.module)
            if correction.line:
                line = correction.line.format(before, value)
                self._texts.note(Severity.ERROR, f"[{correction.module}] {line}")
            parameters.set(name, value, notify=correction.notifies)
