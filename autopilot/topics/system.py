"""The computer, its log, its parameters and its links (writers: system/, logger/, mavlink/)."""

from typing import NamedTuple


class LoggerStatus(NamedTuple):
    """uORB logger_status. Writer: logger.py, once a second."""

    timestamp: int = 0
    is_logging: bool = False
    total_written_kb: float = 0.0
    write_rate_kb_s: float = 0.0
    num_messages: int = 0
    """Topics that it subscribed to."""
    backend: int = 0
    """SDLOG_BACKEND."""


class ParameterUpdate(NamedTuple):
    """uORB parameter_update: parameters have changed. Writer: logger.py, which looks for that."""

    timestamp: int = 0
    instance: int = 0
    """Counts up."""
    active: int = 0
    """Parameters in use."""
    changed: int = 0
    """Those with another value than the airframe's."""
    custom_default: int = 0
    """Those with another default than PX4's."""


class SensorSelection(NamedTuple):
    """uORB sensor_selection: which IMU is flown by, the only one. Writer: sensors/vehicle_imu.py."""

    timestamp: int = 0


class TimesyncStatus(NamedTuple):
    """uORB timesync_status: an answer to TIMESYNC. Writer: mavlink/services/timesync.py; microseconds."""

    timestamp: int = 0
    remote_timestamp: int = 0
    observed_offset: int = 0
    estimated_offset: int = 0
    round_trip_time: int = 0


class TelemetryStatus(NamedTuple):
    """uORB telemetry_status: how a link fares, and who was heard on it. Writer: mavlink/telemetry_status.py."""

    timestamp: int = 0
    mode: int = 0
    data_rate: float = 0.0
    """B/s; the others, too."""
    rate_multiplier: float = 1.0
    tx_rate_avg: float = 0.0
    tx_message_count: int = 0
    rx_rate_avg: float = 0.0
    rx_message_count: int = 0
    rx_message_lost_count: int = 0
    rx_parse_errors: int = 0
    rx_message_lost_rate: float = 0.0
    forwarding: bool = False
    streams: int = 0
    heartbeat_type_antenna_tracker: bool = False
    heartbeat_type_gcs: bool = False
    heartbeat_type_onboard_controller: bool = False
    heartbeat_type_gimbal: bool = False
    heartbeat_type_adsb: bool = False
    heartbeat_type_flarm: bool = False
    heartbeat_type_camera: bool = False
    heartbeat_type_parachute: bool = False
    heartbeat_type_open_drone_id: bool = False
    heartbeat_component_telemetry_radio: bool = False
    heartbeat_component_log: bool = False
    heartbeat_component_osd: bool = False
    heartbeat_component_vio: bool = False
    heartbeat_component_pairing_manager: bool = False
    heartbeat_component_udp_bridge: bool = False
    heartbeat_component_uart_bridge: bool = False
    open_drone_id_system_healthy: bool = False
    parachute_system_healthy: bool = False


class CpuLoad(NamedTuple):
    """Writer: system/load_mon.py. Shares of 1; timestamp 0 where nobody measures them."""

    timestamp: int = 0
    load: float = 0.0
    ram_usage: float = 0.0
