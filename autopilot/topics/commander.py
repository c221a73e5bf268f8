"""State, health and arming (writers: commander/, system/)."""

from typing import NamedTuple

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.flight_mode import NOTHING, ControlMode
from sitl_emu.autopilot.topics.values import NAN
from sitl_emu.autopilot.vehicle_kind import VehicleKind


class VehicleStatus(NamedTuple):
    """Arming and mode.

    `nav_state` is what is flown, `nav_state_user_intention` what was asked for, and `nav_state_display` what
    HEARTBEAT and CURRENT_MODE show: the former, but for a flight that a failsafe has terminated, the latter.
    """

    timestamp: int = 0
    armed: bool = False
    armed_time: int = 0
    takeoff_time: int = 0
    nav_state: NavState = NavState.AUTO_LOITER
    nav_state_user_intention: NavState = NavState.AUTO_LOITER
    nav_state_display: NavState = NavState.AUTO_LOITER
    nav_state_timestamp: int = 0
    """When nav_state last changed."""
    system_status: int = 0
    """MAV_STATE of the heartbeat."""
    failsafe: bool = False
    failsafe_defer: bool = False
    termination: bool = False
    gcs_connection_lost: bool = True
    rc_signal_lost: bool = True
    pre_flight_checks_pass: bool = False
    calibrating: bool = False
    """A calibration runs (calibration_enabled); not the remote control's, which has a flag of its own below."""
    vehicle_kind: VehicleKind = VehicleKind.MULTICOPTER
    mav_type: int = 2
    latest_arming_reason: int = 0
    latest_disarming_reason: int = 0
    gcs_connection_lost_counter: int = 0
    """How often it was lost."""
    failsafe_and_user_took_over: bool = False
    safety_off: bool = True
    """The safety button's breaker (CBRK_IO_SAFETY) is thrown: it counts as there, and pressed."""
    open_drone_id_system_present: bool = False
    open_drone_id_system_healthy: bool = False
    parachute_system_present: bool = False
    parachute_system_healthy: bool = False
    traffic_avoidance_system_present: bool = False
    rc_calibration_in_progress: bool = False
    control_mode: ControlMode = NOTHING
    """vehicle_control_mode, which PX4 tells at the same moments."""


class HealthReport(NamedTuple):
    """Which sensors and systems are there, and well: bits of MAV_SYS_STATUS_SENSOR, and who may arm."""

    timestamp: int = 0
    present: int = 0
    enabled: int = 0
    health: int = 0
    present_extended: int = 0
    """This and the next two: bits of MAV_SYS_STATUS_SENSOR_EXTENDED."""
    enabled_extended: int = 0
    health_extended: int = 0
    can_arm_mode_flags: int = 0
    """Bit per NavState: arming there is allowed."""
    can_run_mode_flags: int = 0
    """Bit per NavState: switching there is allowed."""


class FailsafeFlags(NamedTuple):
    """What is wrong right now, as PX4's failsafe_flags (True is bad)."""

    angular_velocity_invalid: bool = False
    attitude_invalid: bool = True
    local_altitude_invalid: bool = True
    local_position_invalid: bool = True
    local_velocity_invalid: bool = True
    global_position_invalid: bool = True
    auto_mission_missing: bool = True
    offboard_control_signal_lost: bool = True
    home_position_invalid: bool = True
    manual_control_signal_lost: bool = True
    gcs_connection_lost: bool = True
    battery_warning: int = 0
    battery_unhealthy: bool = False
    geofence_breached: bool = False
    mission_failure: bool = False
    wind_limit_exceeded: bool = False
    flight_time_limit_exceeded: bool = False
    fd_critical_failure: bool = False
    fd_motor_failure: bool = False
    parachute_unhealthy: bool = False
    remote_id_unhealthy: bool = False
    fd_imbalanced_prop: bool = False
    local_position_invalid_relaxed: bool = True
    global_position_invalid_relaxed: bool = True
    """There is none, however inexact."""
    battery_low_remaining_time: bool = False
    position_accuracy_low: bool = False
    fd_alt_loss: bool = False
    gnss_lost: bool = False
    navigator_failure: bool = False
    fd_esc_arming_failure: bool = False
    mode_req_local_position: int = 0
    """Bit per NavState that needs one."""


class HomePosition(NamedTuple):
    """Home; x, y, z in the local frame, NaN where it has no place there."""

    timestamp: int = 0
    valid: bool = False
    """On the globe."""
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    x: float = NAN
    y: float = NAN
    z: float = NAN
    yaw: float = NAN
    manual_home: bool = False
    update_count: int = 0
    roll: float = 0.0
    pitch: float = 0.0

    @property
    def valid_lpos(self) -> bool:
        """It has a place in the local frame."""
        return self.x == self.x


class ActuatorArmed(NamedTuple):
    """Whether motors may turn, and servos before them (prearmed); kill stops both."""

    armed: bool = False
    kill: bool = False
    termination: bool = False
    ready_to_arm: bool = False
    prearmed: bool = False
    lockdown: bool = False
    """A throw launch is in progress."""
    in_esc_calibration_mode: bool = False


class ConfigOverrides(NamedTuple):
    """What external modes override; there are none here."""

    disable_auto_disarm: bool = False
    defer_failsafes: bool = False
    disable_auto_set_home: bool = False
    defer_failsafes_timeout_s: int = 0
    source_type: int = 0
    source_id: int = 0


class FailureInjection(NamedTuple):
    """Writer: system/failure_injection.py. Failures that are on: FAILURE_UNIT, FAILURE_TYPE, bit per instance."""

    entries: tuple[tuple[int, int, int], ...] = ()

    def type_of(self, unit: int, instance: int) -> int:
        """FAILURE_TYPE of an instance (1 is the first) of a FAILURE_UNIT; 0: it is well."""
        for failed, kind, instances in self.entries:
            if failed == unit and instances >> (instance - 1) & 1:
                return kind
        return 0


class FailureDetectorStatus(NamedTuple):
    """uORB failure_detector_status: tilted or sunk too far for too long, or shaken as by an unbalanced propeller."""

    timestamp: int = 0
    fd_roll: bool = False
    fd_pitch: bool = False
    fd_alt: bool = False
    fd_imbalanced_prop: bool = False
    imbalanced_prop_metric: float = 0.0
    """m/s²: how much more it shakes sideways than up and down."""
    fd_arm_escs: bool = False
    """Speed controllers do not let their motors turn, or fail."""
    fd_motor: bool = False
    motor_failure_mask: int = 0
    """Bit per motor whose speed controller fails."""
    motor_stop_mask: int = 0
    """Bit per motor: a failure that is injected has stopped it."""
