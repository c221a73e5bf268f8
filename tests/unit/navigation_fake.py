"""A vehicle that is where its setpoint says: enough for commander and navigator, without estimator and controllers."""

import math
from typing import Any

from sitl_emu.autopilot.commander.commander import Commander
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.constants import NavState, SetpointType, Severity
from sitl_emu.autopilot.events.events import Events
from sitl_emu.autopilot.navigator.navigator import Navigator
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import DEVICE_IDS
from sitl_emu.autopilot.storage.dataman import MISSION, Dataman, MissionItem, Plan
from sitl_emu.autopilot.topics import (
    BatteryStatus,
    EscStatus,
    EstimatorStatus,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorMag,
    Topics,
    VehicleAttitude,
    VehicleCommand,
    VehicleGlobalPosition,
    VehicleLandDetected,
    VehicleLocalPosition,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection

HOME_LAT, HOME_LON, HOME_ALT = 47.397743, 8.545594, 489.4
STEP_US = 40_000
"""Half as often as the autopilot runs them, for the sake of quick tests."""
SPEED_M_S = 5.0
PLACE = MapProjection(HOME_LAT, HOME_LON)
READY_US = 7_000_000
"""All is well by then, and the round of events that said so is two seconds old."""


class FakeVehicle:
    """Commander and navigator on a point that moves straight to its setpoint at 5 m/s."""

    def __init__(
        self, kind: VehicleKind = VehicleKind.MULTICOPTER, dataman: Dataman | None = None, /, **parameters: float
    ) -> None:
        rover = kind is VehicleKind.ROVER_ACKERMANN
        base = {"MAV_TYPE": 10 if rover else 13, "NAV_ACC_RAD": 0.5 if rover else 10.0, "COM_LOW_BAT_ACT": 3}
        base |= {"RTL_RETURN_ALT": 30.0, "RTL_DESCEND_ALT": 10.0, "COM_RC_IN_MODE": 1}
        base |= {f"CAL_{sensor}0_ID": device for sensor, device in DEVICE_IDS.items()} | {"CAL_MAG0_PRIO": 50}
        self.rover = rover
        self.parameters = Parameters(kind, base | parameters)
        self.topics = Topics()
        self.dataman = dataman or Dataman()
        self.said: list[str] = []
        self.noted: list[str] = []
        """In the log alone."""
        self.events = Events()
        self.modes: list[str] = []
        self.reached: list[int] = []
        self.current: list[int] = []
        self.setpoints: list[SetpointType] = []
        self.commander = Commander(
            self.topics, self.parameters, self.dataman, self._say, self.events.send, note=self._write
        )
        self.navigator = Navigator(self.topics, self.parameters, self.dataman, self._say, self.events.send)
        self.now_us = 0
        self.north = self.east = self.up = 0.0
        self.landed = self.heading_is_good = True
        self.euler = (0.0, 0.0, 0.0)
        self.turned = 0.0
        """Heading of the estimate."""
        self.velocity = 0.0, 0.0
        """North and east, as the estimate has it; it moves nothing."""
        self.z_resets, self.delta_z = 0, 0.0
        self.gps = self.sensors = self.gcs = True
        self.gps_error_north = 0.0
        self.battery = BatteryStatus(connected=True, remaining=1.0)
        self.rpm: tuple[int, ...] = (0,) if rover else (0,) * 6
        self._armed_for_us = 0
        self._on_ground_us = 0

    def _say(self, severity: Severity, text: str, event: str = "", *arguments: float) -> None:
        if text:
            self.said.append(text)
        if event:
            self.events.send(event, severity, *arguments)

    def _write(self, severity: Severity, line: str) -> None:
        self.noted.append(line)

    def take_texts(self) -> list[str]:
        """What was said since the last call, without the tab of texts that have an event."""
        texts, self.said = [text.rstrip("\t") for text in self.said], []
        return texts

    @property
    def mode(self) -> NavState:
        """Mode that is flown."""
        return self.topics.vehicle_status.nav_state

    @property
    def armed(self) -> bool:
        """Motors may turn."""
        return self.topics.vehicle_status.armed

    def run(self, seconds: float) -> None:
        """Let time go by."""
        for _ in range(round(seconds * 1e6 / STEP_US)):
            self.step()

    def run_until_disarmed(self, limit_s: float = 200.0) -> None:
        """Let time go by until the vehicle has disarmed itself."""
        for _ in range(round(limit_s * 1e6 / STEP_US)):
            self.step()
            if not self.armed:
                return
        raise AssertionError(f"still armed after {limit_s} s in {self.mode.name}, said {self.said}")

    def step(self) -> None:
        """One step: publish what an estimator would, run commander and navigator, move."""
        self.now_us += STEP_US
        self._sense()
        self.commander.update(self.now_us)
        self.navigator.update(self.now_us)
        self._note()
        self._move()

    def command(self, number: int, *params: float) -> CommandResult | None:
        """Send a command; missing parameters are 0."""
        p1, p2, p3, p4, p5, p6, p7 = (*params, *(0.0,) * (7 - len(params)))
        return self.commander.handle_command(
            self.now_us, VehicleCommand(number, p1, p2, p3, p4, p5, p6, p7, source_component=190)
        )

    def result(self, number: int, *params: float) -> int:
        """MAV_RESULT of a command that has to be answered."""
        answer = self.command(number, *params)
        assert answer is not None
        return answer.result

    def set_mode(self, main: int, sub: int = 0) -> int:
        """DO_SET_MODE."""
        return self.result(mavlink.MAV_CMD_DO_SET_MODE, 1, main, sub)

    def arm(self) -> int:
        """COMPONENT_ARM_DISARM 1."""
        return self.result(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)

    def take_off(self, up_m: float) -> None:
        """Arm, take off, reach Hold."""
        assert self.arm() == 0
        nan = math.nan
        assert self.result(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, HOME_ALT + up_m) == 0
        for _ in range(3000):
            self.step()
            if self.mode is NavState.AUTO_LOITER:
                break
        else:
            raise AssertionError("takeoff does not end")
        self.run(1.0)

    def reposition(self, north_m: float, east_m: float, up_m: float, speed: float = -1.0, yaw: float = math.nan) -> int:
        """DO_REPOSITION."""
        lat, lon = PLACE.reproject(north_m, east_m)
        return self.result(mavlink.MAV_CMD_DO_REPOSITION, speed, 1, 0, yaw, lat, lon, HOME_ALT + up_m)

    def upload(self, *items: MissionItem) -> None:
        """A new mission, as the mission service stores it."""
        numbered = tuple(item._replace(seq=seq) for seq, item in enumerate(items))
        self.dataman.store(MISSION, Plan(numbered, opaque_id=1), 0)

    def _sense(self) -> None:
        now, topics = self.now_us, self.topics
        if self.sensors:
            topics.sensor_combined = SensorCombined(now)
            topics.sensor_mag = SensorMag(now, (0.2, 0.0, 0.4))
            topics.sensor_baro = SensorBaro(now, 95000.0, HOME_ALT + self.up)
            topics.vehicle_attitude = VehicleAttitude(now, euler=self.euler)
            topics.estimator_status = EstimatorStatus(now, now, control_mode_flags=0b111)
        lat, lon = PLACE.reproject(self.north, self.east)
        known = self.gps and self.now_us > 1_000_000
        if self.gps:
            received = PLACE.reproject(self.north + self.gps_error_north, self.east)
            topics.sensor_gps = SensorGps(now, *received, HOME_ALT + self.up, fix_type=3)
        topics.vehicle_local_position = VehicleLocalPosition(
            now, now, known, True, known, True, self.north, self.east, -self.up,
            vx=self.velocity[0], vy=self.velocity[1],
            heading=self.turned, heading_good_for_control=self.heading_is_good,
            z_reset_counter=self.z_resets, delta_z=self.delta_z,
            xy_global=True, z_global=True, ref_lat=HOME_LAT, ref_lon=HOME_LON, ref_alt=HOME_ALT, eph=0.5, epv=0.8,
        )  # fmt: skip
        topics.vehicle_global_position = VehicleGlobalPosition(
            now, now, lat, lon, HOME_ALT + self.up, HOME_ALT + self.up, known, known, eph=0.5, epv=0.8
        )
        topics.vehicle_land_detected = VehicleLandDetected(now, self.landed, self.landed, self.landed)
        topics.battery_status = self.battery._replace(timestamp=now)
        if self.rpm and (self.armed or not self.rover):
            topics.esc_status = EscStatus(now, self.rpm)
        if self.gcs:
            topics.gcs_heartbeats = topics.gcs_heartbeats._replace(gcs_us=now)

    def _note(self) -> None:
        result = self.topics.mission_result
        _keep(self.modes, self.mode.name)
        _keep(self.reached, result.seq_reached)
        _keep(self.current, result.seq_current)
        _keep(self.setpoints, SetpointType(self.topics.position_setpoint_triplet.current.type))

    def _move(self) -> None:
        if not self.armed:
            self._armed_for_us = 0
            self.landed = True
            return
        self._armed_for_us += STEP_US
        current = self.topics.position_setpoint_triplet.current
        if self.rover:
            self._drive(current.lat, current.lon, SetpointType(current.type))
            return
        if self.mode is NavState.DESCEND:
            self._approach(self.north, self.east, 0.0)
        elif current.valid and current.type != SetpointType.IDLE and self._armed_for_us > 1_000_000:
            north, east = PLACE.project(current.lat, current.lon)
            up = 0.0 if current.type == SetpointType.LAND else current.alt - HOME_ALT
            self._approach(north, east, up)
        if self.up > 0.3:
            self.landed, self._on_ground_us = False, 0
        else:
            self._on_ground_us += STEP_US
            self.landed = self.landed or self._on_ground_us > 2_000_000

    def _drive(self, lat: float, lon: float, kind: SetpointType) -> None:
        at_home = self.topics.vehicle_status.nav_state is NavState.AUTO_RTL and math.hypot(self.north, self.east) < 0.5
        self.landed = self._armed_for_us < 500_000 or at_home
        if kind is not SetpointType.IDLE and math.isfinite(lat):
            self._approach(*PLACE.project(lat, lon), 0.0)

    def _approach(self, north: float, east: float, up: float) -> None:
        way = SPEED_M_S * STEP_US * 1e-6
        d_north, d_east = north - self.north, east - self.east
        away = math.hypot(d_north, d_east)
        share = min(1.0, way / away) if away > 0.0 else 0.0
        self.north += share * d_north
        self.east += share * d_east
        self.up += max(-0.3 * way, min(0.3 * way, up - self.up))


def _keep(kept: list[Any], value: Any) -> None:
    if not kept or kept[-1] != value:
        kept.append(value)


def item(command: int, north_m: float = 0.0, east_m: float = 0.0, up_m: float = 0.0, *params: float) -> MissionItem:
    """A mission item at a place relative to home; params fill param1.. (param4 defaults to NaN)."""
    p1, p2, p3, p4 = (*params, *(0.0, 0.0, 0.0, math.nan)[len(params) :])
    lat, lon = PLACE.reproject(north_m, east_m)
    return MissionItem(0, 6, command, 1, p1, p2, p3, p4, round(lat * 1e7), round(lon * 1e7), up_m)


def ready() -> FakeVehicle:
    """On the ground, booted: it may be armed."""
    vehicle = FakeVehicle()
    vehicle.run(3.0)
    return vehicle


def settled(**parameters: float) -> FakeVehicle:
    """On the ground, at READY_US, with texts forgotten."""
    vehicle = FakeVehicle(**parameters)
    vehicle.run(READY_US * 1e-6)
    vehicle.take_texts()
    return vehicle


def flying(up_m: float = 10.0, **parameters: float) -> FakeVehicle:
    """In HOLD, with texts and modes forgotten."""
    vehicle = FakeVehicle(**parameters)
    vehicle.run(3.0)
    vehicle.take_off(up_m)
    vehicle.take_texts()
    del vehicle.modes[:-1]
    return vehicle


def place(vehicle: FakeVehicle) -> tuple[float, float, float]:
    return round(vehicle.north, 1), round(vehicle.east, 1), round(vehicle.up, 1)
