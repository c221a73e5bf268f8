"""The log itself, parameters, clocks and links (topics/system.py)."""

from sitl_emu.autopilot.logger.packing import by_name, zeros
from sitl_emu.autopilot.logger.rows.sensors import SIMULATED_IMU
from sitl_emu.autopilot.topics import (
    LoggerStatus,
    ParameterUpdate,
    SensorSelection,
    TelemetryStatus,
    TimesyncStatus,
)

BY_MAVLINK = 0
"""timesync_status.source_protocol: MavlinkTimesync names none."""

logger_status = by_name(
    "logger_status",
    LoggerStatus,
    zeros("dropouts", "message_gaps", "buffer_used_bytes", "buffer_size_bytes", "type"),
)
"""No buffer of ours has a size that it could run over, so nothing is ever lost (PX4's SITL has 1000 KiB)."""
parameter_update = by_name(
    "parameter_update", ParameterUpdate, zeros("get_count", "set_count", "find_count", "export_count")
)
"""How often PX4's functions of parameters were called is theirs to tell."""
sensor_selection = by_name(
    "sensor_selection", SensorSelection, {"accel_device_id": SIMULATED_IMU, "gyro_device_id": SIMULATED_IMU}
)
timesync_status = by_name("timesync_status", TimesyncStatus, {"source_protocol": BY_MAVLINK})
telemetry_status = by_name(
    "telemetry_status",
    TelemetryStatus,
    {
        "mavlink_v2": 1,
        "ftp": 1,
        **zeros("type", "flow_control", "tx_error_rate_avg", "tx_buffer_overruns", "rx_buffer_overruns"),
        **zeros("rx_packet_drop_count"),
    },
)
