"""An autopilot's MAVLink with hand-made topics, and a ground station that speaks to it; no sockets."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.mavlink.mavlink import Mavlink, Modules
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import (
    ActuatorOutputs,
    BatteryStatus,
    DistanceSensorSample,
    EscStatus,
    EstimatorStatus,
    HomePosition,
    RtlTimeEstimate,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorMag,
    Topics,
    VehicleAirData,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleAttitudeSetpoint,
    VehicleCommand,
    VehicleGlobalPosition,
    VehicleImuStatus,
    VehicleLocalPosition,
    VehicleLocalPositionSetpoint,
    VehicleMagnetometer,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core import dialect as mavlink

GCS, ONBOARD, PAYLOAD, GIMBAL, DISPLAY = range(5)
TICK_US = 4_000
GPS_EVERY_US, IMU_STATUS_EVERY_US = 124_000, 100_000
ROVER = 10
LAT_DEG, LON_DEG, ALT_M = 47.397742, 8.545594, 489.4

HandleCommand = Callable[[int, VehicleCommand], CommandResult | None]


class Peer:
    """System `system`, component `component`, heard and spoken to on every link."""

    def __init__(
        self,
        handle_command: HandleCommand = lambda now_us, command: CommandResult(0),
        kind: VehicleKind = VehicleKind.MULTICOPTER,
        system: int = 255,
        component: int = 190,
        root: Path | None = None,
        *,
        display: bool = False,
    ) -> None:
        overrides = {"MAV_SYS_ID": 1, "MAV_TYPE": 13 if kind is VehicleKind.MULTICOPTER else 10, "CA_ROTOR_COUNT": 6}
        self.topics, self.dataman, self.texts = Topics(), Dataman(), Texts()
        self.parameters = Parameters(kind, overrides)
        self.mavlink = Mavlink(
            self.topics,
            self.parameters,
            self.dataman,
            self.texts,
            self.modules(handle_command),
            0,
            root,
            display=display,
        )
        self.now_us = 0
        self.encoder = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self._parsers = [mavlink.MAVLink(None) for _ in self.mavlink.links]

    def modules(self, handle_command: HandleCommand) -> Modules:
        """What MAVLink's services ask; nobody else is there."""
        return Modules(handle_command)

    def send(self, message: Any, link: int = GCS) -> list[Any]:
        """What the autopilot says at once, on that link."""
        frame = bytes(message.pack(self.encoder))
        self.encoder.seq = (self.encoder.seq + 1) & 255
        return self.send_bytes(frame, link)

    def send_bytes(self, data: bytes, link: int = GCS) -> list[Any]:
        """The same with a datagram as it is."""
        self.mavlink.on_datagram(self.now_us, link, data)
        return self.received(link)

    def received(self, link: int = GCS) -> list[Any]:
        """What waits in the outbox of a link."""
        outbox = self.mavlink.links[link].outbox
        messages = [message for data in outbox for message in self._parsers[link].parse_buffer(data) or []]
        outbox.clear()
        return messages

    def run(self, seconds: float, link: int = GCS) -> list[Any]:
        """Let time pass; what was heard on a link."""
        messages: list[Any] = []
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            self.mavlink.update(self.now_us)
            messages += self.received(link)
        return messages

    def fly(self) -> None:
        """Fill the topics of this moment as of a vehicle that stands and knows where."""
        now_us, topics = self.now_us, self.topics
        topics.sensor_combined = SensorCombined(now_us)
        topics.vehicle_imu_status = VehicleImuStatus(now_us // IMU_STATUS_EVERY_US * IMU_STATUS_EVERY_US)
        topics.sensor_mag = SensorMag(now_us, (0.2, 0.0, 0.4))
        topics.vehicle_magnetometer = VehicleMagnetometer(now_us, now_us, (0.2, 0.0, 0.4))
        topics.sensor_baro = SensorBaro(now_us, 95_600.0, 489.0, 20.0)
        topics.vehicle_air_data = VehicleAirData(now_us, now_us, 489.0, 95_600.0, 15.0)
        topics.sensor_gps = SensorGps(
            now_us // GPS_EVERY_US * GPS_EVERY_US, LAT_DEG, LON_DEG, ALT_M, 0.1, 0.0, 0.0, 0.9, 1.78, 3, 10
        )
        topics.distance_sensor = DistanceSensorSample(now_us, 1.0, 0.2, 12.0)
        topics.battery_status = BatteryStatus(now_us, True, 16.2, -1.0, 1.0)
        topics.vehicle_attitude = VehicleAttitude(now_us, euler=(0.1, -0.2, 0.3))
        topics.vehicle_angular_velocity = VehicleAngularVelocity(now_us)
        topics.vehicle_local_position = VehicleLocalPosition(
            now_us,
            now_us,
            True,
            True,
            True,
            True,
            1.0,
            2.0,
            -3.0,
            vx=0.5,
            xy_global=True,
            z_global=True,
            ref_lat=LAT_DEG,
            ref_lon=LON_DEG,
            ref_alt=ALT_M,
        )
        topics.vehicle_global_position = VehicleGlobalPosition(
            now_us, now_us, LAT_DEG, LON_DEG, ALT_M + 3.0, ALT_M + 3.0, True, True
        )
        topics.estimator_status = EstimatorStatus(now_us, now_us, control_mode_flags=0b111)
        topics.home_position = HomePosition(now_us, True, LAT_DEG, LON_DEG, ALT_M, 0.0, 0.0, 0.0, 0.0)
        topics.rtl_time_estimate = RtlTimeEstimate(now_us, True, 20.0, 122.0)
        topics.vehicle_attitude_setpoint = VehicleAttitudeSetpoint(now_us)
        topics.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint(now_us)
        if self.parameters["MAV_TYPE"] != ROVER:
            topics.actuator_outputs = ActuatorOutputs(now_us, (0.0,) * 6, (1000,) * 6)
            topics.esc_status = EscStatus(now_us, (0,) * 6)

    def fly_and_run(self, seconds: float, link: int = GCS) -> list[Any]:
        """Like `run`, with topics that are always fresh."""
        messages: list[Any] = []
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            self.fly()
            self.mavlink.update(self.now_us)
            messages += self.received(link)
        return messages


def names(messages: list[Any]) -> list[str]:
    """Message names, in order."""
    return [message.get_type() for message in messages]


def only(messages: list[Any], name: str) -> list[Any]:
    """The messages of one name."""
    return [message for message in messages if message.get_type() == name]


def command_long(command: int, *params: float, target: tuple[int, int] = (1, 1)) -> Any:
    """A COMMAND_LONG with the rest of its parameters 0."""
    padded = params + (0.0,) * (7 - len(params))
    return mavlink.MAVLink_command_long_message(*target, command, 0, *padded)
