"""Sensors: the simulator's messages become topics.

PX4 v1.18's simulator_mavlink (src/modules/simulation/simulator_mavlink) and vehicle_air_data: units become SI, the
barometer's pressure becomes an altitude by the standard atmosphere (SENS_BARO_QNH), a distance out of range becomes
NaN. The battery is `battery.py`'s. Here the failures that were injected befall the sensors: one that is off says
nothing, one that is stuck says the same for ever, a GPS that is wrong is 100 m off, a battery that is off is empty.
Of GPS, magnetometer and barometer those are not there that PX4 simulates in this airframe and that SENS_EN_GPSSIM,
_MAGSIM and _BAROSIM left out at the start.
Calibrations (CAL_*, SENS_BOARD_*_OFF) are applied; barometer and magnetometer are averaged down to SENS_BARO_RATE and
SENS_MAG_RATE (vehicle_air_data, vehicle_magnetometer), unless they have said the same for too long;
HIL_STATE_QUATERNION (the truth) is kept for the log and for who asks for it.
"""

import math
from typing import Final, NamedTuple

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.battery import Battery
from sitl_emu.autopilot.sensors.data_validator import BARO_EQUAL_VALUES, MAG_EQUAL_VALUES, DataValidator
from sitl_emu.autopilot.sensors.distance_sensors import DOWNWARD
from sitl_emu.autopilot.sensors.imu_integrator import ImuIntegrator
from sitl_emu.autopilot.sensors.sensor_calibration import (
    MOST_RAD_S,
    NONE,
    Corrections,
    corrected_accel,
    corrected_gyro,
    corrected_mag,
    corrections_of,
    is_calibrated,
    priority,
)
from sitl_emu.autopilot.system.failure_injection import (
    ACCEL,
    BARO,
    BATTERY,
    GPS,
    GYRO,
    MAG,
    OFF,
    STUCK,
    WRONG,
)
from sitl_emu.autopilot.topics import (
    NAN,
    DistanceSensorSample,
    EscStatus,
    GroundTruth,
    RangingBeaconRange,
    SensorBaro,
    SensorGps,
    SensorImu,
    SensorMag,
    SensorsStatusImu,
    Topics,
    Vector3,
    VehicleAirData,
    VehicleMagnetometer,
)
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.simulator_api import (
    FIELDS_UPDATED_BARO,
    FIELDS_UPDATED_MAG,
    DistanceSensor,
    EscTelemetry,
    HilGps,
    HilSensor,
    HilStateQuaternion,
    RangingBeacon,
    SimulatedBattery,
    SimulatorMessage,
)

UNKNOWN_DOP: Final = 65535
UNKNOWN_SIGNAL_QUALITY: Final = 0
INVALID_SIGNAL_QUALITY: Final = 1
GREATEST_INT16: Final = 0x7FFF
RANGE_UINT16: Final = 0x10000
"""DISTANCE_SENSOR.current_distance above the first and out of range is a negative one: below the ground (lidar.py)."""
SEA_LEVEL_TEMPERATURE_K: Final = 288.15
LAPSE_RATE_K_M: Final = 0.0065
LARGEST_ACCEL_M_S2: Final = 20_000.0
"""An accelerometer tells no more (ours: SIH's ground stops 50 m/s in a step of 4 ms, 12500; a vehicle without mass goes
beyond)."""
MILLI_G_M_S2: Final = 9.80665e-3
GRAVITY_M_S2: Final = 9.80665
WRONG_DEG: Final = 1.0
"""How far north and east of the truth a wrong GPS is (SensorGpsSim.cpp, SimulatorMavlink.cpp)."""
WRONG_ALTITUDE_M, WRONG_VELOCITY_M_S = 100.0, (5.0, -8.0, 2.0)
"""What else is added to that of an outside simulator (SimulatorMavlink.cpp)."""
PRESSURE_EXPONENT: Final = 287.1 * LAPSE_RATE_K_M / 9.80665
"""With PX4's gas constant (lib/atmosphere)."""
LOWEST_QNH_HPA: Final = 500.0
"""SENS_BARO_QNH has this for its lower bound."""
GAS_CONSTANT_J_KG_K: Final = 287.1
ABSOLUTE_ZERO_C: Final = -273.15
AMBIENT_C: Final = 15.0
"""Of the air, as no barometer inside a vehicle knows it (DEFAULT_TEMPERATURE_CELSIUS, VehicleAirData.cpp)."""


class GpsQuality(NamedTuple):
    """What HIL_GPS does not carry: accuracy of the speed (m/s), dilutions of precision."""

    s_variance_m_s: float
    hdop: float
    vdop: float


SIH_GPS, SIH_GPS_NO_FIX = GpsQuality(0.4, 0.7, 1.1), GpsQuality(100.0, 100.0, 100.0)
"""PX4's sensor_gps_sim (src/modules/simulation/sensor_gps_sim/SensorGpsSim.cpp), which SENS_EN_GPSSIM starts."""
MAVLINK_GPS = GpsQuality(0.25, 0.0, 0.0)
"""PX4's simulator_mavlink (SimulatorMavlink.cpp, handle_message_hil_gps)."""
FIX_3D: Final = 3


class Mean:
    """Adds up samples of a sensor, and hands out their mean no more often than a rate (VehicleMagnetometer.cpp)."""

    def __init__(self, values: int, *, keeps_pace: bool) -> None:
        """`keeps_pace`: the next mean is due an interval after the last was, not after the last one's time."""
        self._sums, self._keeps_pace = [0.0] * values, keeps_pace
        self._time_sum_us = self._count = self._last_us = 0

    def add(self, time_us: int, values: tuple[float, ...], rate_hz: float) -> tuple[int, tuple[float, ...]] | None:
        """Time and values of a mean that is due, or None."""
        self._sums = [total + value for total, value in zip(self._sums, values, strict=True)]
        self._time_sum_us += time_us
        self._count += 1
        mean_us = self._time_sum_us // self._count
        if not rate_hz > 0.0 or mean_us < self._last_us + 1e6 / rate_hz:
            return None
        due_us = self._last_us + int(1e6 / rate_hz)
        behind = mean_us > due_us + 1e6 / rate_hz
        self._last_us = mean_us if behind or not self._keeps_pace else due_us
        mean = tuple(total / self._count for total in self._sums)
        self._sums, self._time_sum_us, self._count = [0.0] * len(mean), 0, 0
        return mean_us, mean


class Sensors:
    """Writer of sensor_imu, _combined, _baro, _mag and _gps, vehicle_magnetometer, vehicle_air_data, distance_sensor,
    esc_status, ranging_beacon and groundtruth."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._now_us = 0
        self.simulates_gps = bool(parameters["SENS_EN_GPSSIM"])
        self.simulates_mag = bool(parameters["SENS_EN_MAGSIM"])
        self.simulates_baro = bool(parameters["SENS_EN_BAROSIM"])
        """As it was at the start (px4-rc.sihsim)."""
        self._has_gps, self._has_mag, self._has_baro = (has_sensor(parameters, kind) for kind in ("GPS", "MAG", "BARO"))
        self._failures = topics.failure_injection
        self._gyro = self._accel = self._mag = self._baro = self._gps = self._battery = 0
        """FAILURE_TYPE of each."""
        self._imu_fails = False
        self._integrator = ImuIntegrator(topics)
        self._mag_mean, self._baro_mean = Mean(3, keeps_pace=False), Mean(1, keeps_pace=True)
        self.mag_validator, self.baro_validator = DataValidator(MAG_EQUAL_VALUES), DataValidator(BARO_EQUAL_VALUES)
        self._mag_calibrations = self._baro_calibrations = 0
        self.battery_simulator = Battery(topics, parameters)
        self._corrections = NONE
        self._corrects = False
        self._mag_disabled = self._baro_disabled = False
        """CAL_…_PRIO 0: it is told of (sensor_mag, sensor_baro), and nobody gets its mean."""
        self._version = -1
        self._truth_origin: tuple[int, MapProjection, float] | None = None
        """When and where the vehicle was at first."""

    def update(self, messages: list[SimulatorMessage]) -> int:
        """Take one tick's messages; the time of its HIL_SENSOR in µs (the last known one if there is none)."""
        if self._topics.failure_injection is not self._failures:
            self._note_failures()
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._take_calibration()
        for message in messages:
            if type(message) is HilSensor:
                self._on_hil_sensor(message)
            elif type(message) is HilGps:
                self._on_hil_gps(message)
            elif type(message) is DistanceSensor:
                self._on_distance_sensor(message)
            elif type(message) is SimulatedBattery:
                self.battery_simulator.measured(self._now_us, message, is_off=self._battery == OFF)
            elif type(message) is HilStateQuaternion:
                self._on_truth(message)
            elif type(message) is EscTelemetry:
                before = self._topics.esc_status.rpm[: message.first]
                self._topics.esc_status = EscStatus(self._now_us, before + message.rpm)
            elif type(message) is RangingBeacon:
                self._on_ranging_beacon(message)
        self.battery_simulator.repeat(self._now_us)
        return self._now_us

    def _take_calibration(self) -> None:
        """What the parameters say; the compass keeps its calibration while armed, until a parameter changes afterwards
        (VehicleMagnetometer::ParametersUpdate)."""
        known, first = self._corrections, not self._integrator.gyro_calibrations
        told = corrections_of(self._parameters, known, first=first)
        self._mag_disabled, self._baro_disabled = (priority(self._parameters, each) == 0 for each in ("MAG", "BARO"))
        if self._topics.vehicle_status.armed:
            told = told._replace(mag_offset=known.mag_offset, mag_matrix=known.mag_matrix)
        self._corrections, self._corrects = told, told != NONE
        self._count_calibrations(known)

    def _count_calibrations(self, before: Corrections) -> None:
        """Who averages and estimates begins anew with another calibration; a gyro's first one counts as well."""
        after, integrator = self._corrections, self._integrator
        first = not integrator.gyro_calibrations and is_calibrated(self._parameters, "GYRO")
        integrator.gyro_calibrations += before.gyro_offset != after.gyro_offset or first
        integrator.accel_calibrations += before.accel_offset != after.accel_offset
        integrator.accel_calibrations += before.accel_scale != after.accel_scale
        self._mag_calibrations += (before.mag_offset, before.mag_matrix) != (after.mag_offset, after.mag_matrix)
        self._baro_calibrations += before.baro_offset_pa != after.baro_offset_pa

    def _note_failures(self) -> None:
        """A compass and a barometer that PX4 simulates itself (SIH: SENS_EN_MAGSIM, SENS_EN_BAROSIM) take no notice of
        failures, and neither does an IMU that comes with them."""
        self._failures = failures = self._topics.failure_injection
        self._gyro, self._accel, self._mag, self._baro, self._gps, self._battery = (
            failures.type_of(unit, 1) for unit in (GYRO, ACCEL, MAG, BARO, GPS, BATTERY)
        )
        if self.simulates_mag:
            self._mag = 0
        if self.simulates_baro:
            self._baro = self._gyro = self._accel = 0
        self._imu_fails = bool(self._gyro or self._accel)
        self._topics.sensors_status_imu = SensorsStatusImu(not self._accel, not self._gyro)

    def _on_hil_sensor(self, message: HilSensor) -> None:
        (now_us, ax, ay, az, gx, gy, gz, mx, my, mz, pressure_hpa, _, _, temperature_c, updated, _) = message
        self._now_us = now_us
        topics = self._topics
        raw_gyro, raw_accel, raw_field, raw_pa = (gx, gy, gz), (ax, ay, az), (mx, my, mz), pressure_hpa * 100.0
        gyro, accel, field = raw_gyro, raw_accel, raw_field
        if self._corrects:
            corrections = self._corrections
            gyro, accel = corrected_gyro(gyro, corrections), corrected_accel(accel, corrections)
            field = corrected_mag(field, corrections)
            pressure_hpa -= 0.01 * corrections.baro_offset_pa
        (x, y, z), (u, v, w) = gyro, accel
        total = abs(x) + abs(y) + abs(z) + abs(u) + abs(v) + abs(w)
        makes_sense = total < math.inf
        if total > LARGEST_ACCEL_M_S2:
            gyro, accel = _clipped(gyro, MOST_RAD_S), _clipped(accel, LARGEST_ACCEL_M_S2)
            raw_gyro, raw_accel = _clipped(raw_gyro, MOST_RAD_S), _clipped(raw_accel, LARGEST_ACCEL_M_S2)
        if makes_sense and self._imu_fails:
            self._publish_failing_imu(SensorImu(now_us, gyro, accel, raw_gyro, raw_accel))
        elif makes_sense:
            topics.sensor_imu = SensorImu(now_us, gyro, accel, raw_gyro, raw_accel)
            self._integrator.update(now_us, gyro, accel)
        mag_updated = updated & FIELDS_UPDATED_MAG == FIELDS_UPDATED_MAG and math.isfinite(sum(field))
        if mag_updated and self._mag != OFF and self._has_mag:
            if self._mag == STUCK:
                _, field, raw_field = topics.sensor_mag
            topics.sensor_mag = SensorMag(now_us, field, raw_field)
            if not self._mag_disabled:
                self._average_mag(now_us, field)
        baro_updated = updated & FIELDS_UPDATED_BARO and 0.0 < pressure_hpa < math.inf
        if baro_updated and self._baro != OFF and self._has_baro:
            if self._baro == STUCK:
                topics.sensor_baro = topics.sensor_baro._replace(timestamp=now_us)
                pressure_hpa = topics.sensor_baro.pressure_pa * 0.01
            else:
                baro_alt_m = altitude_m(pressure_hpa, float(self._parameters["SENS_BARO_QNH"]))
                topics.sensor_baro = SensorBaro(now_us, pressure_hpa * 100.0, baro_alt_m, temperature_c, raw_pa)
            if not self._baro_disabled:
                self._average_baro(now_us, pressure_hpa)

    def _average_mag(self, now_us: int, field: Vector3) -> None:
        self.mag_validator.put(now_us, field)
        due = self._mag_mean.add(now_us, field, self._parameters["SENS_MAG_RATE"])
        if due is None or self.mag_validator.stale:
            return
        sample_us, (x, y, z) = due
        self._topics.vehicle_magnetometer = VehicleMagnetometer(now_us, sample_us, (x, y, z), self._mag_calibrations)

    def _average_baro(self, now_us: int, pressure_hpa: float) -> None:
        told = self._topics.sensor_baro
        self.baro_validator.put(now_us, (told.pressure_pa, told.temperature_c, told.baro_alt_m))
        due = self._baro_mean.add(now_us, (pressure_hpa,), self._parameters["SENS_BARO_RATE"])
        if due is None or self.baro_validator.stale:
            return
        sample_us, (pressure_hpa,) = due
        pressure_pa = pressure_hpa * 100.0
        self._topics.vehicle_air_data = VehicleAirData(
            now_us,
            sample_us,
            altitude_m(pressure_hpa, float(self._parameters["SENS_BARO_QNH"])),
            pressure_pa,
            AMBIENT_C,
            pressure_pa / (GAS_CONSTANT_J_KG_K * (AMBIENT_C - ABSOLUTE_ZERO_C)),
            self._baro_calibrations,
        )

    def _publish_failing_imu(self, sample: SensorImu) -> None:
        """Without one of them there is no sensor_combined, as in PX4."""
        if OFF in (self._gyro, self._accel):
            return
        last = self._topics.sensor_imu
        of_gyro = last if self._gyro == STUCK else sample
        of_accel = last if self._accel == STUCK else sample
        gyro, accel = of_gyro.gyro_rad_s, of_accel.accelerometer_m_s2
        raw = of_gyro.raw_gyro_rad_s, of_accel.raw_accelerometer_m_s2
        self._topics.sensor_imu = SensorImu(sample.timestamp, gyro, accel, *raw)
        self._integrator.update(sample.timestamp, gyro, accel)

    def _on_hil_gps(self, message: HilGps) -> None:
        if self._gps == OFF or not self._has_gps:
            return
        timestamp = self._now_us if message.time_usec == 0 else message.time_usec
        if self._gps == STUCK:
            # one that PX4 simulates tells when it was measured, and so it is too old for the estimator
            self._topics.sensor_gps = self._topics.sensor_gps._replace(timestamp=timestamp)
            return
        simulated_by_px4 = self.simulates_gps
        quality = MAVLINK_GPS
        if simulated_by_px4:
            quality = SIH_GPS if message.fix_type >= FIX_3D else SIH_GPS_NO_FIX
        jump_deg, climb_m, velocity = 0.0, 0.0, (0.0, 0.0, 0.0)
        if self._gps == WRONG:
            jump_deg = WRONG_DEG
            if not simulated_by_px4:
                climb_m, velocity = WRONG_ALTITUDE_M, WRONG_VELOCITY_M_S
        self._topics.sensor_gps = SensorGps(
            timestamp,
            message.lat * 1e-7 + jump_deg,
            message.lon * 1e-7 + jump_deg,
            message.alt * 1e-3 + climb_m,
            message.vn * 1e-2 + velocity[0],
            message.ve * 1e-2 + velocity[1],
            message.vd * 1e-2 + velocity[2],
            NAN if message.eph == UNKNOWN_DOP else message.eph * 1e-2,
            NAN if message.epv == UNKNOWN_DOP else message.epv * 1e-2,
            message.fix_type,
            message.satellites_visible,
            *quality,
            timestamp_sample=timestamp if simulated_by_px4 else 0,
        )

    def _on_distance_sensor(self, message: DistanceSensor) -> None:
        if message.orientation != DOWNWARD:
            return
        distance, nearest, farthest = message.current_distance, message.min_distance, message.max_distance
        within = nearest <= distance <= farthest
        below_ground = not within and distance > GREATEST_INT16
        self._topics.distance_sensor = DistanceSensorSample(
            message.time_boot_ms * 1000,
            distance * 1e-2 if within else (distance - RANGE_UINT16) * 1e-2 if below_ground else NAN,
            nearest * 1e-2,
            farthest * 1e-2,
            message.orientation,
            signal_quality=signal_quality(message.signal_quality, within=within),
        )

    def _on_ranging_beacon(self, message: RangingBeacon) -> None:
        self._topics.ranging_beacon = RangingBeaconRange(
            message.time_usec,
            message.beacon_id,
            message.range * 1e-3,
            message.range_accuracy * 1e-3,
            message.lat * 1e-7,
            message.lon * 1e-7,
            message.alt,
            message.hacc_est * 1e-3,
            message.vacc_est * 1e-3,
        )

    def _on_truth(self, message: HilStateQuaternion) -> None:
        time_us, lat, lon, alt = message.time_usec, message.lat * 1e-7, message.lon * 1e-7, message.alt * 1e-3
        if self._truth_origin is None:
            self._truth_origin = time_us, MapProjection(lat, lon), alt
        since_us, projection, ref_alt = self._truth_origin
        self._topics.groundtruth = GroundTruth(
            time_us,
            message.attitude_quaternion,
            (message.rollspeed, message.pitchspeed, message.yawspeed),
            lat,
            lon,
            alt,
            *projection.project(lat, lon),
            ref_alt - alt,
            message.vx * 1e-2,
            message.vy * 1e-2,
            message.vz * 1e-2,
            projection.lat0_deg,
            projection.lon0_deg,
            ref_alt,
            since_us,
            *acceleration_ned(message),
        )


def has_sensor(parameters: Parameters, kind: str) -> bool:
    """Whether there is a GPS, MAG or BARO.

    One that PX4 simulates itself in this airframe (SENS_EN_…SIM by default) is left out of a start by 0
    (px4-rc.sihsim); another's comes from outside, whatever the parameter says.
    """
    name = f"SENS_EN_{kind}SIM"
    return bool(parameters[name] or not parameters.default(name))


def signal_quality(told: int, *, within: bool) -> int:
    """UORB's percentage of MAVLink's, which begins at 1; who does not know it (-1) is out of range or not."""
    if told == UNKNOWN_SIGNAL_QUALITY:
        return -1 if within else 0
    return round(100 * (told - INVALID_SIGNAL_QUALITY) / (100 - INVALID_SIGNAL_QUALITY))


def _clipped(vector: Vector3, limit: float) -> Vector3:
    x, y, z = vector
    return max(-limit, min(limit, x)), max(-limit, min(limit, y)), max(-limit, min(limit, z))


def acceleration_ned(message: HilStateQuaternion) -> Vector3:
    """The true acceleration in the world's frame, m/s²: what the accelerometers feel, and gravity."""
    w, x, y, z = message.attitude_quaternion
    ax, ay, az = (MILLI_G_M_S2 * value for value in (message.xacc, message.yacc, message.zacc))
    return (
        (1.0 - 2.0 * (y * y + z * z)) * ax + 2.0 * (x * y - w * z) * ay + 2.0 * (x * z + w * y) * az,
        2.0 * (x * y + w * z) * ax + (1.0 - 2.0 * (x * x + z * z)) * ay + 2.0 * (y * z - w * x) * az,
        2.0 * (x * z - w * y) * ax + 2.0 * (y * z + w * x) * ay + (1.0 - 2.0 * (x * x + y * y)) * az + GRAVITY_M_S2,
    )


def altitude_m(pressure_hpa: float, sea_level_hpa: float) -> float:
    """Pressure altitude above the level where pressure is `sea_level_hpa` (hypsometric equation, ISA up to 11 km)."""
    ratio: float = (pressure_hpa / max(sea_level_hpa, LOWEST_QNH_HPA)) ** PRESSURE_EXPONENT
    return SEA_LEVEL_TEMPERATURE_K / LAPSE_RATE_K_M * (1.0 - ratio)
