"""The simulator's end of the seam, for one vehicle: dynamics and sensors, one tick of 4 ms at a time.

Messages: HIL_SENSOR every tick, last (250 Hz; magnetometer and barometer at their own rates, as fields_updated says);
when due HIL_GPS, DISTANCE_SENSOR, speed controllers at 12.5 Hz, battery at 5 Hz, beacons at 2 Hz and the truth
(HIL_STATE_QUATERNION) at 83 Hz (https://mavlink.io/en/messages/common.html; PX4:
src/modules/simulation/simulator_mavlink). A state machine on
simulated time: `tick` is all that happens. The autopilot's parameters do not exist in here; what PX4's own simulator
reads of them are plain attributes named alike (`sih_wind_n`, `sim_gps_used`, `sim_bat_drain`, …),
which an autopilot sets beside the simulator API (`simulator_parameters.py`).
"""

import math
import struct
from typing import Final, NamedTuple

from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.geomagnetism import magnetic_field
from sitl_emu.core.simulator_api import (
    FIELDS_UPDATED_ACCEL,
    FIELDS_UPDATED_BARO,
    FIELDS_UPDATED_GYRO,
    FIELDS_UPDATED_MAG,
    EscTelemetry,
    HilActuatorControls,
    HilSensor,
    HilStateQuaternion,
    SimulatedBattery,
    SimulatorMessage,
)
from sitl_emu.vehicles.ackermann import Ackermann
from sitl_emu.vehicles.battery import Px4Battery, battery_model
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.vehicles.dynamics import STEP_S, Dynamics, Quaternion, Surface, slope
from sitl_emu.vehicles.multicopter import SLOPE_REACH_M, Multicopter
from sitl_emu.vehicles.sih_ackermann import SihAckermann
from sitl_emu.world.atmosphere import gravity_m_s2
from sitl_emu.world.ground import Terrain
from sitl_emu.world.home import Home as Home
from sitl_emu.world.obstacles import Areas, Obstacles
from sitl_emu.world.sensors.barometer import Barometer
from sitl_emu.world.sensors.gps import Gps
from sitl_emu.world.sensors.imu import Imu
from sitl_emu.world.sensors.lidar import Lidar
from sitl_emu.world.sensors.magnetometer import Magnetometer
from sitl_emu.world.sensors.ranging_beacons import RANGING_EVERY_US, RangingBeacons
from sitl_emu.world.wind import Wind

TICK_US: Final = 4000
BATTERY_EVERY_US: Final = 200_000
TRUTH_EVERY_US: Final = 8_000
"""Ours: often enough for the 100 a second that its log takes, as PX4's, whose SIH tells it with each step."""
ESCS_EVERY_US: Final = 80_000
ESCS_PER_MESSAGE: Final = 4
RPM_PER_RAD_S: Final = 60.0 / math.tau
NEVER_US: Final = 1 << 62
MODE_FLAG_SAFETY_ARMED: Final = 128
IMU_UPDATED: Final = FIELDS_UPDATED_ACCEL | FIELDS_UPDATED_GYRO
MILLI_G: Final = 9.80665e-3
_FLOATS = struct.Struct("<7f")


class Pose(NamedTuple):
    """Truth of one vehicle at a time: NED metres from the world's origin, quaternion body to NED."""

    time_usec: int
    north_m: float
    east_m: float
    down_m: float
    vn_m_s: float
    ve_m_s: float
    vd_m_s: float
    q: Quaternion
    rate_rad_s: tuple[float, float, float]
    """Of the body, in its axes FRD."""
    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


class VehicleSimulator:
    """One simulated vehicle. It starts at rest on the terrain, `start_north_m`, `start_east_m` from the world's origin.
    `obstacles`: what stands there, which its lidar sees and its gear can stand on; `areas`: water and foliage.

    Failures are attributes, to be set at any time: `gps_off`, `baro_off`, `mag_off`, `lidar_off` silence a sensor,
    `motor_off[i]` stops a motor. Equal arguments give equal runs; `name` and `seed` choose the noise.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        home: Home,
        seed: int,
        terrain: Terrain,
        wind: Wind | None = None,
        start_north_m: float = 0.0,
        start_east_m: float = 0.0,
        name: str = "vehicle",
        obstacles: Obstacles | None = None,
        areas: Areas | None = None,
    ) -> None:
        self.vehicle, self.home, self.name = vehicle, home, name
        self.time_usec = 0
        self._projection = MapProjection(home.lat_deg, home.lon_deg)
        self._terrain = terrain
        spheres = vehicle.body.spheres if vehicle.body is not None else ()
        self.reach_m = max((math.hypot(*sphere.centre_m) + sphere.radius_m for sphere in spheres), default=0.0)
        """How far its body reaches from its centre of mass."""
        self._wind = wind if wind is not None and not vehicle.wind_is_px4s else Wind()
        start = (start_north_m, start_east_m, math.radians(home.heading_deg))
        self.dynamics: Dynamics = _dynamics(vehicle, home, terrain, start, obstacles)
        self.motor_off: list[bool] = self.dynamics.motor_off if isinstance(self.dynamics, Multicopter) else [False]
        self.gps_off = self.baro_off = self.mag_off = self.lidar_off = False
        self.sih_wind_n = self.sih_wind_e = 0.0
        """PX4's SIH_WIND_N, SIH_WIND_E in m/s: air that moves *south*, *west*; they add to the world's wind."""

        sensors = vehicle.sensors
        self._imu = Imu(sensors.imu, seed, name, home.lat_deg)
        self.magnetometer = Magnetometer(sensors.magnetometer, magnetic_field(home.lat_deg, home.lon_deg), seed, name)
        self.barometer = Barometer(sensors.barometer, seed, name)
        self._gps = Gps(sensors.gps, self._projection, home.alt_amsl_m, seed, name)
        self._lidar = Lidar(sensors.lidar, terrain, seed, name, obstacles, areas) if sensors.lidar else None
        self.battery = battery_model(vehicle.battery)
        self._mag_every, self._mag_due, self._mag_at = _period_us(sensors.magnetometer.rate_hz), 0, 0
        self._baro_every, self._baro_at = _period_us(sensors.barometer.rate_hz), 0
        self._gps_every, self._gps_at = _period_us(sensors.gps.rate_hz), 0
        self._lidar_every = _period_us(sensors.lidar.rate_hz) if sensors.lidar else 0
        self._lidar_at = 0 if sensors.lidar else NEVER_US
        self._battery_at = self._truth_at = 0
        self._beacons = (
            RangingBeacons(self._projection, home.alt_amsl_m, seed, name) if vehicle.ranging_beacons else None
        )
        self._beacons_at = RANGING_EVERY_US if self._beacons else NEVER_US
        self._full_rpm = vehicle.motor_speed_max_rad_s * RPM_PER_RAD_S
        self._escs_at = 0 if self._full_rpm > 0.0 else NEVER_US
        self._due_at = 0
        self._mag = self.magnetometer.read(self.dynamics.q)
        self._pressure = self.barometer.read(home.alt_amsl_m - self.dynamics.down_m)
        self._by_output = vehicle.sih_rover is not None
        self._escs_by_output = self._by_output or (vehicle.gear is not None and vehicle.gear.is_px4s)
        self._output_us = -ESCS_EVERY_US
        self._was_armed = False
        self._controls: tuple[float, ...] = ()
        self._armed = False

    def describe(self, vehicle: Vehicle) -> None:
        """Take other figures of the vehicle as it flies: its dynamics and what its lidar reaches."""
        self.vehicle = vehicle
        self.dynamics.describe(vehicle)
        if self._lidar is not None and vehicle.sensors.lidar is not None:
            self._lidar.data = vehicle.sensors.lidar

    @property
    def sim_gps_used(self) -> int:
        """Satellites in use (PX4's SIM_GPS_USED); fewer than four give no fix."""
        return self._gps.satellites

    @sim_gps_used.setter
    def sim_gps_used(self, satellites: int) -> None:
        self._gps.satellites = satellites

    @property
    def sih_distsnsr_ovr(self) -> float:
        """What the lidar says instead of what it sees, m (PX4's SIH_DISTSNSR_OVR); NaN where there is none."""
        return self._lidar.override_m if self._lidar is not None else math.nan

    @sih_distsnsr_ovr.setter
    def sih_distsnsr_ovr(self, distance_m: float) -> None:
        if self._lidar is not None:
            self._lidar.override_m = distance_m

    @property
    def sih_rngbc_noise(self) -> float:
        """How far the ranges of the beacons are wrong, m (PX4's SIH_RNGBC_NOISE); NaN where there are none."""
        return self._beacons.sih_rngbc_noise if self._beacons is not None else math.nan

    @sih_rngbc_noise.setter
    def sih_rngbc_noise(self, noise_m: float) -> None:
        if self._beacons is not None:
            self._beacons.sih_rngbc_noise = noise_m

    @property
    def gps_offset_m(self) -> tuple[float, float, float]:
        """How far the GPS is wrong, north, east and down."""
        return self._gps.offset_m

    @gps_offset_m.setter
    def gps_offset_m(self, offset_m: tuple[float, float, float]) -> None:
        self._gps.offset_m = offset_m

    @property
    def sim_bat_drain(self) -> float:
        """Seconds in which an armed vehicle empties its battery (PX4's SIM_BAT_DRAIN); NaN where the load does that."""
        return self.battery.sim_bat_drain if isinstance(self.battery, Px4Battery) else math.nan

    @sim_bat_drain.setter
    def sim_bat_drain(self, seconds: float) -> None:
        if isinstance(self.battery, Px4Battery):
            self.battery.sim_bat_drain = seconds

    @property
    def sim_bat_min_pct(self) -> float:
        """Charge below which it does not fall (PX4's SIM_BAT_MIN_PCT); NaN where the load drains the battery."""
        return self.battery.sim_bat_min_pct if isinstance(self.battery, Px4Battery) else math.nan

    @sim_bat_min_pct.setter
    def sim_bat_min_pct(self, percent: float) -> None:
        if isinstance(self.battery, Px4Battery):
            self.battery.sim_bat_min_pct = percent

    def tick(self, controls: HilActuatorControls | None) -> list[SimulatorMessage]:
        """Advance by 4 ms under these controls (None: none came, the last ones hold); HIL_SENSOR comes last."""
        if controls is not None:
            self._armed = controls.mode & MODE_FLAG_SAFETY_ARMED != 0
            self._was_armed = self._was_armed or self._armed
            # SIH's rover moves its actuators only when an output comes: between two, and disarmed, they stay
            told_before = self._by_output and controls.time_usec == self._output_us
            self._controls = () if told_before else controls.controls
            self._output_us = controls.time_usec
        elif self._by_output:
            self._controls = ()
        now_us = self.time_usec = self.time_usec + TICK_US
        wind = self._wind
        if wind.calm:
            wind_n = wind_e = wind_d = 0.0
        else:
            wind_n, wind_e, wind_d = wind.at(now_us, self._over_ground_m() if wind.grows_with_height else 0.0)
        body = self.dynamics
        body.step(self._controls, wind_n - self.sih_wind_n, wind_e - self.sih_wind_e, wind_d)

        updated = IMU_UPDATED
        messages: list[SimulatorMessage] = []
        if now_us >= self._due_at:
            updated |= self._slow_sensors(now_us, messages)
        reading = self._imu.read(
            body.ax_m_s2, body.ay_m_s2, body.az_m_s2, body.p_rad_s, body.q_rad_s, body.r_rad_s, body.q, body.running
        )
        pressure, pressure_alt = self._pressure
        temperature = self.barometer.temperature_c
        messages.append(HilSensor(now_us, *reading, *self._mag, pressure, 0.0, pressure_alt, temperature, updated, 0))
        return messages

    def _over_ground_m(self) -> float:
        body = self.dynamics
        return -body.down_m - self._terrain.height_m(body.north_m, body.east_m)

    def pose(self) -> Pose:
        """Where the vehicle really is: for camera, scoring and radio."""
        body = self.dynamics
        lat, lon = self._projection.reproject(body.north_m, body.east_m)
        return Pose(
            self.time_usec, body.north_m, body.east_m, body.down_m, body.vn_m_s, body.ve_m_s, body.vd_m_s, body.q,
            (body.p_rad_s, body.q_rad_s, body.r_rad_s), lat, lon, self.home.alt_amsl_m - body.down_m,
        )  # fmt: skip

    @property
    def controls(self) -> tuple[float, ...]:
        """The autopilot's last outputs, as HIL_ACTUATOR_CONTROLS has them; empty before the first."""
        return self._controls

    def truth(self) -> HilStateQuaternion:
        """HIL_STATE_QUATERNION of now; accelerations in mg, as MAVLink has them."""
        pose, body = self.pose(), self.dynamics
        w, x, y, z, p, q, r = _FLOATS.unpack(_FLOATS.pack(*body.q, body.p_rad_s, body.q_rad_s, body.r_rad_s))
        airspeed = _int16(100.0 * math.sqrt(body.vn_m_s**2 + body.ve_m_s**2 + body.vd_m_s**2))
        return HilStateQuaternion(
            pose.time_usec, (w, x, y, z), p, q, r,
            round(pose.lat_deg * 1e7), round(pose.lon_deg * 1e7), round(pose.alt_amsl_m * 1e3),
            _int16(body.vn_m_s * 100), _int16(body.ve_m_s * 100), _int16(body.vd_m_s * 100),
            max(airspeed, 0), max(airspeed, 0),
            _int16(body.ax_m_s2 / MILLI_G), _int16(body.ay_m_s2 / MILLI_G), _int16(body.az_m_s2 / MILLI_G),
        )  # fmt: skip

    def _slow_sensors(self, now_us: int, messages: list[SimulatorMessage]) -> int:
        """Read what is due besides the IMU; the bits it adds to fields_updated."""
        body, updated = self.dynamics, 0
        if now_us >= self._mag_at:
            self._mag_due = _next_us(self._mag_due, self._mag_every, now_us)
            self._mag_at = self._mag_due - TICK_US * self.magnetometer.is_early()
            if not self.mag_off:
                self._mag = self.magnetometer.read(body.q)
                updated |= FIELDS_UPDATED_MAG
        if now_us >= self._baro_at:
            self._baro_at = _next_us(self._baro_at, self._baro_every, now_us)
            if not self.baro_off:
                self._pressure = self.barometer.read(self.home.alt_amsl_m - body.down_m)
                updated |= FIELDS_UPDATED_BARO
        if now_us >= self._gps_at:
            self._gps_at = _next_us(self._gps_at, self._gps_every, now_us)
            if not self.gps_off:
                messages.append(
                    self._gps.read(
                        now_us, body.north_m, body.east_m, body.down_m, body.vn_m_s, body.ve_m_s, body.vd_m_s
                    )
                )
        if self._lidar and now_us >= self._lidar_at:
            self._lidar_at = _next_us(self._lidar_at, self._lidar_every, now_us)
            if not self.lidar_off and not self._lidar.is_off:
                messages.append(self._lidar.read(now_us, body.north_m, body.east_m, body.down_m, body.q))
        if now_us >= self._battery_at:
            self._battery_at = _next_us(self._battery_at, BATTERY_EVERY_US, now_us)
            messages.append(self._battery_message())
        if now_us >= self._truth_at:
            self._truth_at = _next_us(self._truth_at, TRUTH_EVERY_US, now_us)
            messages.append(self.truth())
        if now_us >= self._escs_at:
            self._escs_at = _next_us(self._escs_at, ESCS_EVERY_US, now_us)
            messages += self._esc_messages(now_us)
        if self._beacons and now_us >= self._beacons_at:
            self._beacons_at = _next_us(self._beacons_at, RANGING_EVERY_US, now_us)
            messages.append(self._beacons.read(now_us, body.north_m, body.east_m, body.down_m))
        slow = (self._mag_at, self._baro_at, self._gps_at, self._lidar_at, self._battery_at, self._truth_at)
        self._due_at = min(*slow, self._escs_at, self._beacons_at)
        return updated

    def _esc_messages(self, now_us: int) -> list[SimulatorMessage]:
        """How fast the motors turn; SIH says so only when outputs come (read_motors), its rover's first by arming."""
        silent = self._escs_by_output and now_us - self._output_us >= ESCS_EVERY_US
        if silent or (self._by_output and not self._was_armed):
            return []
        rpm = tuple([round(self._full_rpm * speed) for speed in self.dynamics.motor_speeds()])
        firsts = range(0, len(rpm), ESCS_PER_MESSAGE)
        return [EscTelemetry(now_us, first, rpm[first : first + ESCS_PER_MESSAGE]) for first in firsts]

    def _battery_message(self) -> SimulatedBattery:
        battery = self.battery
        battery.step(BATTERY_EVERY_US * 1e-6, self.dynamics.power_w, self._armed)
        self.dynamics.drive = battery.drive
        measured = not isinstance(battery, Px4Battery)
        current_a = battery.current_a if measured else math.nan
        return SimulatedBattery(battery.voltage_v, current_a, 100.0 * battery.remaining)


def _dynamics(
    vehicle: Vehicle,
    home: Home,
    terrain: Terrain,
    start: tuple[float, float, float],
    obstacles: Obstacles | None,
) -> Dynamics:
    gravity = gravity_m_s2(home.lat_deg)
    if vehicle.propulsion is not None:
        surface = None if obstacles is None else _surface(terrain, obstacles)
        return Multicopter(vehicle, terrain.height_m, *start, gravity, surface)
    if vehicle.chassis is not None:
        return Ackermann(vehicle, terrain.height_m, *start, gravity)
    return SihAckermann(vehicle, terrain.height_m, *start, gravity, home.lat_deg, home.lon_deg)


def _surface(terrain: Terrain, obstacles: Obstacles) -> Surface:
    """What a gear stands on: a roof, or the ground."""

    def below(north_m: float, east_m: float, down_m: float) -> tuple[float, float, float]:
        met = obstacles.surface(north_m, east_m, down_m)
        return slope(terrain.height_m, north_m, east_m, SLOPE_REACH_M) if met is None else met

    return below


def _period_us(rate_hz: float) -> int:
    return round(1e6 / rate_hz)


def _next_us(at_us: int, every_us: int, now_us: int) -> int:
    """The next due time on a grid that does not drift: a period of 125 ms stays 8 Hz on ticks of 4 ms."""
    following = at_us + every_us
    return following if following > now_us else now_us + every_us


def _int16(value: float) -> int:
    return max(-32768, min(32767, round(value)))


assert round(STEP_S * 1e6) == TICK_US
