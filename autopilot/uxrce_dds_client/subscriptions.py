"""What comes in: messages of /fmu/in/… become records of ours, at the same places as what MAVLink brings.

Times are moved to the vehicle's clock as PX4 does (ucdr_deserialize in Tools/msg/templates/ucdr/msg.h.em): 0 is now,
and nothing is later than now. Topics that are not in `Subscriptions.handlers` are taken and change nothing; the page
docs/ros2.md says which they are.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, tell
from sitl_emu.autopilot.sensors.distance_sensors import DOWNWARD
from sitl_emu.autopilot.topics import (
    FRAME_BODY_FRD,
    NAN3,
    SOURCE_MAVLINK_0,
    AuxGlobalPosition,
    DistanceSensorSample,
    GcsHeartbeats,
    ManualControlInput,
    ObstacleDistance,
    OnboardComputerStatus,
    SensorOpticalFlow,
    Topics,
    VehicleCommand,
    VehicleOdometry,
    VehicleOpticalFlow,
    with_instance,
)
from sitl_emu.autopilot.uxrce_dds_client import cdr, external_modes
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import SUBSCRIPTIONS
from sitl_emu.autopilot.uxrce_dds_client.external_modes import Reply
from sitl_emu.autopilot.uxrce_dds_client.offboard import Offboard

Fields = Mapping[str, Any]
WRAP: Final = 1 << 64
AUTOPILOT: Final = 1
"""Its component id."""
LONGEST_FLOW_S: Final = 1.0
HEARTBEATS: Final = {
    "gcs": "gcs_us",
    "onboard_controller": "onboard_us",
    "parachute": "parachute_us",
    "open_drone_id": "open_drone_id_us",
    "adsb": "adsb_us",
    "flarm": "adsb_us",
}
"""Of telemetry_status.heartbeat_type_*, what each is to GcsHeartbeats."""
SYSTEMS: Final = ("parachute", "open_drone_id")
"""Those that say whether they are well."""
DDS: Final = "dds "
MOST_SOURCES: Final = 4
"""Of aux_global_position (dds_topics.yaml, max_instances)."""
UNREADABLE: Final = 0
"""distance_sensor.signal_quality of a measurement that is none."""


def local_time(now_us: int, told_us: int, time_offset_us: int) -> int:
    """A message's time on the vehicle's clock."""
    return now_us if told_us == 0 else min((told_us - time_offset_us) % WRAP, now_us)


class Subscriptions:
    """Writer of what ROS 2 tells; one writer more for each of these topics, beside the services of MAVLink."""

    def __init__(
        self,
        topics: Topics,
        system_id: int,
        handle_command: Callable[[int, VehicleCommand], CommandResult | None],
        reply: Callable[[int, Reply], None],
    ) -> None:
        """`handle_command` lets the owner of a command decide; `reply` publishes answers (now_us, answer)."""
        self._topics, self._system_id = topics, system_id
        self._handle_command, self._reply = handle_command, reply
        offboard = Offboard(topics)
        self.handlers: dict[str, Callable[[int, Fields], None]] = {
            "offboard_control_mode": offboard.offboard_control_mode,
            "trajectory_setpoint": offboard.trajectory_setpoint,
            "goto_setpoint": offboard.goto_setpoint,
            "rover_speed_setpoint": offboard.rover_speed_setpoint,
            "rover_attitude_setpoint": offboard.rover_attitude_setpoint,
            "rover_rate_setpoint": offboard.rover_rate_setpoint,
            "rover_throttle_setpoint": offboard.rover_throttle_setpoint,
            "rover_steering_setpoint": offboard.rover_steering_setpoint,
            "vehicle_attitude_setpoint": offboard.vehicle_attitude_setpoint,
            "vehicle_rates_setpoint": offboard.vehicle_rates_setpoint,
            "vehicle_thrust_setpoint": offboard.vehicle_thrust_setpoint,
            "vehicle_torque_setpoint": offboard.vehicle_torque_setpoint,
            "actuator_motors": offboard.actuator_motors,
            "actuator_servos": offboard.actuator_servos,
            "vehicle_command": self._vehicle_command,
            "telemetry_status": self._telemetry_status,
            "onboard_computer_status": self._onboard_computer_status,
            "aux_global_position": self._aux_global_position,
            "vehicle_visual_odometry": self._vehicle_visual_odometry,
            "obstacle_distance": self._obstacle_distance,
            "distance_sensor": self._distance_sensor,
            "sensor_optical_flow": self._sensor_optical_flow,
            "manual_control_input": self._manual_control_input,
            "register_ext_component_request": self._answer(external_modes.register_ext_component),
            "setpoint_config": self._answer(external_modes.setpoint_config),
            "message_format_request": self._answer(external_modes.message_format),
        }
        self._readers = {
            number: (cdr.Reader(topic.type), self.handlers[topic.name])
            for number, topic in enumerate(SUBSCRIPTIONS)
            if topic.name in self.handlers
        }

    def on_sample(self, now_us: int, topic: int, data: bytes, time_offset_us: int) -> None:
        """A message of a topic, by its place in SUBSCRIPTIONS; one that is too short is no message."""
        found = self._readers.get(topic)
        if found is None:
            return
        reader, handle = found
        if len(data) < reader.size:
            return
        fields = reader.read(data)
        for name in ("timestamp", "timestamp_sample"):
            if name in fields:
                fields[name] = local_time(now_us, fields[name], time_offset_us)
        handle(now_us, fields)

    def _answer(self, make: Callable[[Fields], Reply]) -> Callable[[int, Fields], None]:
        return lambda now_us, fields: self._reply(now_us, make(fields))

    def _vehicle_command(self, now_us: int, fields: Fields) -> None:
        """One for another system or component is nobody's here, and not answered (Commander::handle_command)."""
        if fields["target_system"] not in (0, self._system_id) or fields["target_component"] not in (0, AUTOPILOT):
            return
        command = vehicle_command(fields)
        result = self._handle_command(now_us, command)
        if result is not None:
            tell(self._topics, now_us, command, result)

    def _vehicle_visual_odometry(self, now_us: int, fields: Fields) -> None:
        self._topics.vehicle_visual_odometry = odometry(fields)

    def _telemetry_status(self, now_us: int, fields: Fields) -> None:
        """Heartbeats that came over a link of ROS 2's (Commander::dataLinkCheck)."""
        self._topics.gcs_heartbeats = heartbeats(self._topics.gcs_heartbeats, fields)

    def _onboard_computer_status(self, now_us: int, fields: Fields) -> None:
        told = OnboardComputerStatus(**{name: fields[name] for name in OnboardComputerStatus._fields})
        self._topics.onboard_computer_status = told

    def _aux_global_position(self, now_us: int, fields: Fields) -> None:
        """Each id is an instance of its own (dds_topics.yaml, route_field), of the first four."""
        known, told = self._topics.aux_global_position, aux_global_position(fields)
        ids = {each.publisher for each in known if each.publisher.startswith(DDS)}
        if told.publisher in ids or len(ids) < MOST_SOURCES:
            self._topics.aux_global_position = with_instance(known, told)

    def _obstacle_distance(self, now_us: int, fields: Fields) -> None:
        self._topics.obstacle_distance = obstacle_distance(fields)

    def _distance_sensor(self, now_us: int, fields: Fields) -> None:
        """As the first sensor that there is, whoever else speaks as that one (uORB::Publication)."""
        topics, sample = self._topics, distance_sensor(fields)
        if topics.distance_sensor.timestamp or not topics.distance_sensors_outside:
            topics.distance_sensor = sample
        else:
            first, *others = topics.distance_sensors_outside
            topics.distance_sensors_outside = (sample._replace(publisher=first.publisher), *others)

    def _sensor_optical_flow(self, now_us: int, fields: Fields) -> None:
        self._topics.sensor_optical_flow = SensorOpticalFlow(
            fields["pixel_flow"],
            fields["delta_angle"] if fields["delta_angle_available"] else NAN3,
            fields["integration_timespan_us"],
            fields["quality"],
            fields["distance_m"] if fields["distance_available"] else math.nan,
            fields["timestamp"],
            fields["device_id"],
        )
        sample = optical_flow(fields, self._topics.vehicle_angular_velocity.xyz)
        if sample is not None:
            self._topics.vehicle_optical_flow = sample

    def _manual_control_input(self, now_us: int, fields: Fields) -> None:
        sticks = manual_control(fields)
        if sticks is not None:
            self._topics.manual_control_mavlink = sticks


def vehicle_command(fields: Fields) -> VehicleCommand:
    """A command; infinite parameters count as not given (NaN), as those that come over MAVLink do."""
    one, two, three, four, five, six, seven = (
        value if math.isfinite(value) else math.nan for value in (fields[f"param{n}"] for n in range(1, 8))
    )
    return VehicleCommand(
        fields["command"],
        *(one, two, three, four, five, six, seven),
        source_system=fields["source_system"],
        source_component=fields["source_component"],
        target_system=fields["target_system"],
        target_component=fields["target_component"],
        from_external=fields["from_external"],
        confirmation=fields["confirmation"],
    )


def odometry(fields: Fields) -> VehicleOdometry:
    """A pose and velocity; a velocity frame that PX4 does not know is none."""
    velocity_frame = fields["velocity_frame"]
    return VehicleOdometry(
        fields["timestamp_sample"],
        fields["pose_frame"],
        fields["position"],
        fields["q"],
        velocity_frame if velocity_frame <= FRAME_BODY_FRD else 0,
        fields["velocity"],
        fields["position_variance"],
        fields["orientation_variance"],
        fields["velocity_variance"],
        fields["reset_counter"],
        fields["quality"],
        fields["timestamp"],
        fields["angular_velocity"],
    )


def heartbeats(last: GcsHeartbeats, fields: Fields) -> GcsHeartbeats:
    """Who was heard, and who of them is well; who was not keeps his time."""
    time_us: int = fields["timestamp"]
    told: dict[str, Any] = {name: time_us for flag, name in HEARTBEATS.items() if fields[f"heartbeat_type_{flag}"]}
    for system in SYSTEMS:
        if f"{system}_us" in told:
            told[f"{system}_healthy"] = fields[f"{system}_system_healthy"]
    return last._replace(**told)


def aux_global_position(fields: Fields) -> AuxGlobalPosition:
    """A place as it is told."""
    told = {name: fields[name] for name in AuxGlobalPosition._fields if name != "publisher"}
    return AuxGlobalPosition(**told, publisher=f"{DDS}{fields['id']}")


def obstacle_distance(fields: Fields) -> ObstacleDistance:
    """Distances around the vehicle; an increment or offset that is no number is 0."""
    increment, offset = (
        value if math.isfinite(value) else 0.0 for value in (fields["increment"], fields["angle_offset"])
    )
    return ObstacleDistance(
        fields["timestamp"],
        fields["frame"],
        fields["distances"],
        max(0.0, increment),
        fields["min_distance"],
        fields["max_distance"],
        offset,
        sensor_type=fields["sensor_type"],
    )


def distance_sensor(fields: Fields) -> DistanceSensorSample:
    """NaN where a sensor that looks down sees nothing within its range; a sideways one's stays, for its quality."""
    nearest, farthest, current = fields["min_distance"], fields["max_distance"], fields["current_distance"]
    good = nearest <= current <= farthest and fields["signal_quality"] != UNREADABLE
    fov = fields["h_fov"] if math.isfinite(fields["h_fov"]) else 0.0
    return DistanceSensorSample(
        fields["timestamp"],
        current if good or fields["orientation"] != DOWNWARD else math.nan,
        nearest,
        farthest,
        fields["orientation"],
        max(0.0, min(2.0 * math.pi, fov)),
        fields["signal_quality"],
        current,
        fields["type"],
        fields["variance"],
        fields["v_fov"],
        fields["q"],
        device_id=fields["device_id"],
    )


def optical_flow(fields: Fields, rates: tuple[float, float, float]) -> VehicleOpticalFlow | None:
    """Flow free of the vehicle's own rotation, by the sensor's gyro or by `rates`; None for a time that is none."""
    dt_s = fields["integration_timespan_us"] * 1e-6
    flow_x, flow_y = fields["pixel_flow"]
    if not (0.0 < dt_s <= LONGEST_FLOW_S and math.isfinite(flow_x + flow_y)):
        return None
    turned = fields["delta_angle"]
    if not (fields["delta_angle_available"] and math.isfinite(sum(turned))):
        turned = (rates[0] * dt_s, rates[1] * dt_s, rates[2] * dt_s)
    return VehicleOpticalFlow(
        fields["timestamp"],
        (flow_x - turned[0]) / dt_s,
        (flow_y - turned[1]) / dt_s,
        fields["quality"],
        fields["integration_timespan_us"],
        (flow_x, flow_y),
        turned,
        fields["distance_m"] if fields["distance_available"] else math.nan,
        fields["device_id"],
    )


def manual_control(fields: Fields) -> ManualControlInput | None:
    """Sticks of a joystick; None where they are not valid, or said to come from the RC, which is not here."""
    axes = (fields["roll"], fields["pitch"], fields["yaw"], fields["throttle"])
    if not fields["valid"] or fields["data_source"] < SOURCE_MAVLINK_0 or not math.isfinite(sum(axes)):
        return None
    roll, pitch, yaw, throttle = (max(-1.0, min(1.0, axis)) for axis in axes)
    one, two, three, four, five, six = (
        value if math.isfinite(value) else 0.0 for value in (fields[f"aux{n}"] for n in range(1, 7))
    )
    return ManualControlInput(
        fields["timestamp"],
        fields["data_source"],
        *(roll, pitch, yaw, throttle),
        fields["buttons"],
        (one, two, three, four, five, six),
    )
