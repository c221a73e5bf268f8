"""Sensors of a level vehicle on a given path, for the estimator's tests: noise as PX4's SIH has it."""

import math
import random
from collections.abc import Callable

from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.topics import Topics, Vector3, VehicleLandDetected
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.geomagnetism import magnetic_field
from sitl_emu.core.simulator_api import HilGps, HilSensor, SimulatorMessage
from sitl_emu.world.atmosphere import gravity_m_s2

LAT, LON, ALT_M = 47.39774, 8.545594, 488.0
FIELD = magnetic_field(LAT, LON)
DECLINATION = FIELD.declination_rad
SPIN_RAD_S = 7.292115e-5
TICK_S = 0.004
GRAVITY_M_S2 = gravity_m_s2(LAT)
Path = Callable[[float], tuple[Vector3, Vector3, Vector3]]
"""Time to position, velocity and acceleration, NED."""


def standing(_: float) -> tuple[Vector3, Vector3, Vector3]:
    return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


class Feed:
    """Steps an estimator; `yaw` of the vehicle is fixed, what is public may be changed on the way."""

    def __init__(self, path: Path = standing, yaw: float = 0.7, **parameters: float) -> None:
        calibrated = {f"CAL_{sensor}0_ID": device for sensor, device in DEVICE_IDS.items()}
        airframe = {**calibrated, "EKF2_REQ_GPS_H": 0.5, "SENS_GPS0_DELAY": 0, **parameters}
        self.parameters, self.topics = Parameters(VehicleKind.MULTICOPTER, airframe), Topics()
        self.sensors = Sensors(self.topics, self.parameters)
        self.estimator = Estimator(self.topics, self.parameters)
        self.path, self.yaw = path, yaw
        self.gps = self.baro = True
        self.in_ground_effect = False
        self.gps_offset_m = self.gps_offset_up_m = self.accel_bias_z = self.gyro_bias_x = 0.0
        self.ticks = 0
        self.random = random.Random(1)
        self.projection = MapProjection(LAT, LON)

    @property
    def time_s(self) -> float:
        return self.ticks * TICK_S

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.step()

    def step(self) -> None:
        self.ticks += 1
        position, velocity, acceleration = self.path(self.time_s)
        moving = any(velocity)
        self.topics.vehicle_land_detected = VehicleLandDetected(
            self.ticks * 4000,
            not moving,
            not moving,
            not moving,
            in_ground_effect=self.in_ground_effect,
            at_rest=not moving,
        )
        messages: list[SimulatorMessage] = []
        if self.gps and self.ticks % 31 == 0:
            messages.append(self._fix(position, velocity))
        messages.append(self._imu(position, acceleration))
        self.estimator.update(self.sensors.update(messages))

    def _fix(self, position: Vector3, velocity: Vector3) -> HilGps:
        gauss = self.random.gauss
        lat, lon = self.projection.reproject(position[0] + self.gps_offset_m + gauss(0, 0.1), position[1])
        vn, ve, vd = (round((v + gauss(0, 0.05)) * 100) for v in velocity)
        alt = round((ALT_M - position[2] + self.gps_offset_up_m + gauss(0, 0.1)) * 1000)
        now_us = self.ticks * 4000
        return HilGps(now_us, round(lat * 1e7), round(lon * 1e7), alt, 90, 178, 0, vn, ve, vd, 0, 3, 10, 0, 0)

    def _imu(self, position: Vector3, acceleration: Vector3) -> HilSensor:
        gauss = self.random.gauss
        fields, mag, pressure = 0b111111, (0.0, 0.0, 0.0), 0.0
        if self.ticks % 5 == 0:
            fields |= 0b111000000
            horizontal = FIELD.strength_gauss * math.cos(FIELD.inclination_rad)
            mx, my = self._to_body(horizontal * math.cos(DECLINATION), horizontal * math.sin(DECLINATION))
            mz = FIELD.strength_gauss * math.sin(FIELD.inclination_rad)
            mag = (mx + gauss(0, 0.012), my + gauss(0, 0.012), mz + gauss(0, 0.012))
        if self.baro and self.ticks % 12 == 0:
            fields |= 0b1101000000000
            height = ALT_M - position[2] + gauss(0, 0.1)
            pressure = 1013.25 * (1.0 - 0.0065 * height / 288.15) ** 5.2559
        ax, ay = self._to_body(acceleration[0], acceleration[1])
        spin_x, spin_y = self._to_body(SPIN_RAD_S * math.cos(math.radians(LAT)), 0.0)
        return HilSensor(
            self.ticks * 4000,
            ax + gauss(0, 0.07),
            ay + gauss(0, 0.07),
            acceleration[2] - GRAVITY_M_S2 + self.accel_bias_z + gauss(0, 0.07),
            self.gyro_bias_x + spin_x + gauss(0, 0.007),
            spin_y + gauss(0, 0.007),
            -SPIN_RAD_S * math.sin(math.radians(LAT)) + gauss(0, 0.007),
            *mag,
            pressure,
            0.0,
            0.0,
            15.0,
            fields,
            0,
        )

    def _to_body(self, north: float, east: float) -> tuple[float, float]:
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return c * north + s * east, -s * north + c * east
