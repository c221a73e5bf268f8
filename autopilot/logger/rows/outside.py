"""Sticks, radio and what others tell or carry (topics/manual_control.py, outside.py, payload.py)."""

import math
from collections.abc import Sequence

from sitl_emu.autopilot.logger.packing import Pack, Value, by_name, row, zeros
from sitl_emu.autopilot.topics import (
    ActionRequest,
    AuxGlobalPosition,
    DebugArray,
    DebugKeyValue,
    DebugValue,
    DebugVect,
    Gripper,
    InputRc,
    ManualControlSetpoint,
    ManualControlSwitches,
    ObstacleDistance,
    OnboardComputerStatus,
    RadioStatus,
    SensorOpticalFlow,
    TransponderReport,
    VehicleOdometry,
    VehicleOpticalFlow,
)

NAN = math.nan
NAME, NUMBERS = 10, 58
"""Lengths of names and of debug_array.data."""
DIRECTIONS = 72
"""Places in obstacle_distance.distances."""

RC_CHANNELS = 18
RC_OVER_MAVLINK = 6
"""input_rc.input_source."""
UNKNOWN = -1
CALLSIGN, UAS_ID = 9, 18
RETRANSLATE = 1 << 6
"""transponder_report.flags: MAVLink tells it again."""
GRIPPER_GRAB, GRIPPER_RELEASE = 0, 1
"""gripper.command."""


def padded(values: Sequence[float], length: int) -> tuple[float, ...]:
    """An array of fixed length."""
    return (*values[:length], *(0,) * (length - len(values)))


@row("input_rc")
def input_rc(pack: Pack, record: InputRc) -> bytes:
    """Channels of an RC that came over MAVLink; its signal is not known."""
    time_us, channels = record
    signal = (UNKNOWN, float("nan"), 0, 0, 0, 0)
    tail = (len(channels), False, False, RC_OVER_MAVLINK, UNKNOWN, UNKNOWN)
    return pack(time_us, time_us, *signal, *padded(channels, RC_CHANNELS), *tail)


manual_control_setpoint = by_name(
    "manual_control_setpoint",
    ManualControlSetpoint,
    {"timestamp_sample": "timestamp", **zeros("flaps")},
    ("aux1", "aux2", "aux3", "aux4", "aux5", "aux6"),
    lambda record: record.aux,
)
manual_control_switches = by_name(
    "manual_control_switches",
    ManualControlSwitches,
    {
        "timestamp_sample": "timestamp",
        "arm_switch": "arm",
        "return_switch": "return_to_launch",
        "loiter_switch": "loiter",
        "offboard_switch": "offboard",
        "kill_switch": "kill",
        "termination_switch": "terminate",
        "gear_switch": "gear",
        **zeros("switch_changes", "transition_switch", "photo_switch"),
        **zeros("video_switch", "engage_main_motor_switch", "payload_power_switch"),
    },
)
gripper = by_name(
    "gripper",
    Gripper,
    {"timestamp": 0},
    ("command",),
    lambda record: (GRIPPER_GRAB if record.position > 0.0 else GRIPPER_RELEASE,),
)


@row("action_request")
def action_request(pack: Pack, record: ActionRequest) -> bytes:
    """What a switch or a gesture asks for."""
    return pack(record.timestamp, record.action, record.source, record.mode)


_OF_ODOMETRY: dict[str, float | str] = {"timestamp": "told_us", "timestamp_sample": "timestamp"}
vehicle_visual_odometry = by_name("vehicle_visual_odometry", VehicleOdometry, _OF_ODOMETRY)
vehicle_mocap_odometry = by_name("vehicle_mocap_odometry", VehicleOdometry, _OF_ODOMETRY)


def _distances(record: ObstacleDistance) -> tuple[Value, ...]:
    return padded(record.distances, DIRECTIONS)


obstacle_distance = by_name("obstacle_distance", ObstacleDistance, None, ("distances",), _distances)
obstacle_distance_fused = by_name("obstacle_distance_fused", ObstacleDistance, None, ("distances",), _distances)
vehicle_optical_flow = by_name("vehicle_optical_flow", VehicleOpticalFlow, {"timestamp_sample": "timestamp"})


def _flow(record: SensorOpticalFlow) -> tuple[Value, ...]:
    """Zeros where the sensor has no gyro or no range."""
    turns, ranges = math.isfinite(sum(record.delta_angle)), math.isfinite(record.distance_m)
    turned = record.delta_angle if turns else (0.0, 0.0, 0.0)
    return *turned, record.distance_m if ranges else 0.0, turns, ranges


sensor_optical_flow = by_name(
    "sensor_optical_flow",
    SensorOpticalFlow,
    {
        "timestamp_sample": "timestamp",
        **dict.fromkeys(("max_flow_rate", "min_ground_distance", "max_ground_distance"), NAN),
        **zeros("error_count", "mode"),
    },
    ("delta_angle", "distance_m", "delta_angle_available", "distance_available"),
    _flow,
)
aux_global_position = by_name("aux_global_position", AuxGlobalPosition)
onboard_computer_status = by_name("onboard_computer_status", OnboardComputerStatus)
radio_status = by_name("radio_status", RadioStatus)


def _characters(name: bytes) -> tuple[bytes, ...]:
    padded_name = name[:NAME].ljust(NAME, b"\0")
    return tuple(padded_name[n : n + 1] for n in range(NAME))


@row("debug_key_value")
def debug_key_value(pack: Pack, record: DebugKeyValue) -> bytes:
    """A named number."""
    return pack(record.timestamp, record.value, *_characters(record.key))


@row("debug_value")
def debug_value(pack: Pack, record: DebugValue) -> bytes:
    """A numbered one."""
    return pack(record.timestamp, record.value, record.ind)


@row("debug_vect")
def debug_vect(pack: Pack, record: DebugVect) -> bytes:
    """Three of them."""
    return pack(record.timestamp, *record.xyz, *_characters(record.name))


@row("debug_array")
def debug_array(pack: Pack, record: DebugArray) -> bytes:
    """Many of them."""
    return pack(record.timestamp, *padded(record.data, NUMBERS), record.id, *_characters(record.name))


@row("transponder_report")
def transponder_report(pack: Pack, record: TransponderReport) -> bytes:
    """An aircraft nearby; who it is (uas_id) is not told."""
    callsign = record.callsign[:CALLSIGN].ljust(CALLSIGN, b"\0")
    return pack(
        record.timestamp,
        record.lat,
        record.lon,
        record.icao_address,
        record.altitude,
        record.heading,
        record.hor_velocity,
        record.ver_velocity,
        record.flags | (RETRANSLATE if record.retranslate else 0),
        record.squawk,
        record.altitude_type,
        *(callsign[n : n + 1] for n in range(CALLSIGN)),
        record.emitter_type,
        record.tslc,
        *(0,) * UAS_ID,
    )
