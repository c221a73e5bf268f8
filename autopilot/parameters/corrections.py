"""Parameters without sense that PX4's modules set right by themselves (v1.18), outside the position controller.

Each row is a module that looks for changed parameters once a second and what it corrects then. What it corrects
without a notification (param_set_no_notification) is told with the next change of another parameter.
"""

from collections.abc import Callable
from typing import NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.parameters.subscription_interval import PARAMETER_UPDATE_INTERVAL_US, SubscriptionInterval
from sitl_emu.autopilot.vehicle_kind import Traits

MAV_TYPES = 50
"""PX4's MAV_TYPE_ENUM_END (Mavlink::mavlink_update_parameters); our dialect's is older by one."""
MAG_FUSE_TYPES = (0, 1, 5, 6)
"""EKF2_MAG_TYPE: automatic, heading, none, at the start alone (EKF2.cpp, MagFuseType)."""
CRAWL_SPEED_MARGIN = 1.2
"""MulticopterLandDetector::_update_params: MPC_LAND_CRWL and MPC_LAND_SPEED are so much faster than LNDMC_Z_VEL_MAX."""


class Correction(NamedTuple):
    """A module, the parameter that it may correct, what it makes of it, and whether it notifies others."""

    module: str
    name: str
    corrected: Callable[[Parameters], Value]
    notifies: bool


def _land_detector_speed(parameters: Parameters) -> float:
    most = min(float(parameters["MPC_LAND_CRWL"]), float(parameters["MPC_LAND_SPEED"])) / CRAWL_SPEED_MARGIN
    return min(float(parameters["LNDMC_Z_VEL_MAX"]), most)


def _integration_rate(parameters: Parameters) -> int:
    return max(50, min(1000, int(parameters["IMU_INTEG_RATE"])))


def _gyro_rate(parameters: Parameters) -> int:
    rate = int(parameters["IMU_GYRO_RATEMAX"])
    return max(50, min(10_000, rate if rate > 0 else int(parameters.default("IMU_GYRO_RATEMAX"))))


def _mag_type(parameters: Parameters) -> int:
    kind = int(parameters["EKF2_MAG_TYPE"])
    return kind if kind in MAG_FUSE_TYPES else 0


def _vehicle_type(parameters: Parameters) -> int:
    kind = int(parameters["MAV_TYPE"])
    return kind if 0 <= kind < MAV_TYPES else 0


EVERYWHERE = (
    Correction("vehicle_imu", "IMU_INTEG_RATE", _integration_rate, False),
    Correction("vehicle_angular_velocity", "IMU_GYRO_RATEMAX", _gyro_rate, False),
    Correction("vehicle_magnetometer", "CAL_MAG_SIDES", lambda parameters: parameters["SENS_MAG_SIDES"], True),
    Correction("ekf2", "EKF2_MAG_TYPE", _mag_type, True),
    Correction("mavlink", "MAV_TYPE", _vehicle_type, False),
)
OF_LAND_DETECTOR = {"multicopter": (Correction("land_detector", "LNDMC_Z_VEL_MAX", _land_detector_speed, False),)}
"""By Traits.land_detector."""


class ParameterCorrections:
    """The modules of one vehicle that correct parameters."""

    def __init__(self, parameters: Parameters, say: Say, traits: Traits) -> None:
        """`say` tells what ekf2 tells the ground; the other modules write to the console alone."""
        self._parameters = parameters
        self._say = say
        self._corrections = EVERYWHERE + OF_LAND_DETECTOR.get(traits.land_detector, ())
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
            if name == "EKF2_MAG_TYPE":
                text = "EKF2_MAG_TYPE invalid, resetting to default"
                self._say(Severity.CRITICAL, text, "ekf2_mag_type_invalid", float(before))
            parameters.set(name, value, notify=correction.notifies)
