"""What the checks write into: the failsafe flags of this moment, what forbids arming, and what to tell people.

PX4's `Report` (src/modules/commander/HealthAndArmingChecks/Common.hpp, v1.18).
"""

from enum import IntEnum
from typing import Final, NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import FailsafeFlags

# MAV_SYS_STATUS_SENSOR bits (MAVLink common)
GYRO: Final = 0x01
ACCEL: Final = 0x02
MAG: Final = 0x04
ABSOLUTE_PRESSURE: Final = 0x08
GPS: Final = 0x20
ATTITUDE_STABILIZATION: Final = 0x800
XY_POSITION_CONTROL: Final = 0x4000
MOTOR_OUTPUTS: Final = 0x8000
RC_RECEIVER: Final = 0x10000
AHRS: Final = 0x200000
LOGGING: Final = 0x1000000
BATTERY: Final = 0x2000000
PREARM_CHECK: Final = 0x10000000
# MAV_SYS_STATUS_SENSOR_EXTENDED bits (MAVLink common)
RECOVERY_SYSTEM: Final = 0x01


ALL_MODES: Final = 0xFFFFFFFF
"""Also the bits that stand for no mode, as in PX4."""
NO_MODE: Final = 0
"""A failure that forbids nothing; people are told that it concerns all modes."""


class Component(IntEnum):
    """health_component_t of the events; several are the bits of an int."""

    ABSOLUTE_PRESSURE = 1 << 1
    GPS = 1 << 3
    OPTICAL_FLOW = 1 << 4
    DISTANCE_SENSOR = 1 << 6
    REMOTE_CONTROL = 1 << 7
    MOTORS_ESCS = 1 << 8
    LOGGING = 1 << 10
    BATTERY = 1 << 11
    COMMUNICATION_LINKS = 1 << 12
    ATTITUDE_ESTIMATE = 1 << 16
    LOCAL_POSITION_ESTIMATE = 1 << 17
    SYSTEM = 1 << 20
    GLOBAL_POSITION_ESTIMATE = 1 << 24
    PARACHUTE = 1 << 26
    MAGNETOMETER = 1 << 27
    ACCEL = 1 << 28
    GYRO = 1 << 29
    OPEN_DRONE_ID = 1 << 30
    TRAFFIC_AVOIDANCE = 1 << 31


class Failure(NamedTuple):
    """One failure as its event tells it."""

    event: str
    level: int
    """Severity, or DISABLED: it is not sent, but that there is one is a change to report."""
    modes: int
    """Bit per NavState: those that it forbids."""
    component: Component
    arguments: tuple[float, ...]
    told_modes: int
    """Those that people are told it concerns: the same, but for warnings."""


class Notice(NamedTuple):
    """Told each time, by an event alone, whether or not anything has changed."""

    event: str
    level: Severity
    arguments: tuple[float, ...] = ()


class Settings(NamedTuple):
    """Parameters that the checks obey, copied when they change."""

    com_pos_fs_eph_m: float
    com_vel_fs_evh_m_s: float
    com_of_loss_us: int
    com_rc_loss_us: int
    com_dl_loss_us: int
    com_flt_time_max_us: int
    com_arm_wo_gps: int
    com_armable: int
    com_arm_mag_str: int
    com_arm_bat_min: float
    com_arm_mis_req: int
    sys_has_gps: int
    sys_has_mag: int
    sys_has_baro: int
    cbrk_supply_chk: int
    nav_dll_act: int
    com_arm_odid: int
    com_arm_traff: int
    com_parachute: int
    com_power_count: int
    com_arm_chk_escs: int
    fd_act_en: int
    esc_temp_warn_th_c: float
    calibrated: frozenset[str]
    """Sensors with a calibration of their own: ACC, GYRO, MAG."""
    mag_enabled: bool
    """Whether the magnetometer's calibration has a priority (CAL_MAGn_PRIO) above 0."""
    com_rc_in_mode: int
    rc_channels: tuple[tuple[float, float, float], ...]
    """Of each its least, its centre and its most, in microseconds."""
    com_cc_temp_warn: float
    rtl_type: int
    com_pos_low_eph_m: float
    com_pos_low_act: int
    com_wind_warn: float
    com_wind_max: float
    com_wind_max_act: int
    com_gnssloss_act: int
    sys_has_num_dist: int
    sys_has_num_gnss: int
    sys_has_num_of: int
    com_cpu_max: float
    com_ram_max: float


class Findings:
    """Filled by one round of checks. Flags begin as good; a check that finds trouble says so."""

    def __init__(self, mode_req_local_position: int = 0) -> None:
        self.mode_req_local_position = mode_req_local_position
        self.angular_velocity_invalid = False
        self.attitude_invalid = False
        self.local_altitude_invalid = False
        self.local_position_invalid = False
        self.local_velocity_invalid = False
        self.global_position_invalid = False
        self.auto_mission_missing = False
        self.offboard_control_signal_lost = False
        self.home_position_invalid = False
        self.manual_control_signal_lost = False
        self.gcs_connection_lost = False
        self.battery_warning = 0
        self.position_accuracy_low = self.fd_alt_loss = self.gnss_lost = False
        self.battery_unhealthy = self.battery_low_remaining_time = False
        self.geofence_breached = self.navigator_failure = False
        self.mission_failure = False
        self.wind_limit_exceeded = False
        self.flight_time_limit_exceeded = False
        self.fd_critical_failure = False
        self.fd_motor_failure = self.fd_esc_arming_failure = False
        self.parachute_unhealthy = False
        self.remote_id_unhealthy = False
        self.fd_imbalanced_prop = False
        self.local_position_invalid_relaxed = self.global_position_invalid_relaxed = False
        self.arm_authorization_denied = False
        """Somebody wants to arm now, and has no leave (COM_ARM_AUTH_REQ)."""
        self.arming_forbidden = 0
        """Bit per NavState."""
        self.texts: dict[str, Severity] = {}
        self.lasting_texts: dict[str, Severity] = {}
        """Told once while they last, not with every report."""
        self.failures: list[Failure] = []
        self.notices: list[Notice] = []
        self.health_present = 0
        self.health_error = self.health_warning = 0
        self.arming_error = self.arming_warning = 0
        """Bits of Component."""

    @property
    def blamed(self) -> int:
        """Components, as bits, with which anything is wrong."""
        return self.health_error | self.health_warning | self.arming_error | self.arming_warning

    def health_failure(
        self, modes: int, component: Component, level: Severity, event: str, *arguments: float, text: str = ""
    ) -> None:
        """Something is broken; arming is forbidden in `modes`. `text` is what PX4 tells beside the event."""
        if level <= Severity.ERROR:
            self.health_error |= component
        elif level <= Severity.WARNING:
            self.health_warning |= component
        self._fail(Failure(event, level, modes, component, arguments, modes or ALL_MODES), text)

    def arming_check_failure(
        self,
        modes: int,
        component: Component,
        level: int,
        event: str,
        *arguments: float,
        text: str = "",
        said_as: Severity = Severity.CRITICAL,
        told_modes: int = NO_MODE,
    ) -> None:
        """Something is not as it has to be for a flight; arming is forbidden in `modes`.

        `said_as`: of the text, which most checks say as critical, warnings too. `told_modes`: what it concerns, where
        it forbids none of them.
        """
        if level <= Severity.ERROR:
            self.arming_error |= component
        elif level <= Severity.WARNING:
            self.arming_warning |= component
        told_modes = modes or told_modes or ALL_MODES
        self._fail(Failure(event, level, modes, component, arguments, told_modes), text, said_as)

    def _fail(self, failure: Failure, text: str, said_as: Severity = Severity.CRITICAL) -> None:
        self.failures.append(failure)
        self.arming_forbidden |= failure.modes
        if text:
            self.texts[text] = said_as

    def flags(self) -> FailsafeFlags:
        """The record for the topic."""
        return FailsafeFlags(
            self.angular_velocity_invalid,
            self.attitude_invalid,
            self.local_altitude_invalid,
            self.local_position_invalid,
            self.local_velocity_invalid,
            self.global_position_invalid,
            self.auto_mission_missing,
            self.offboard_control_signal_lost,
            self.home_position_invalid,
            self.manual_control_signal_lost,
            self.gcs_connection_lost,
            self.battery_warning,
            self.battery_unhealthy,
            self.geofence_breached,
            self.mission_failure,
            self.wind_limit_exceeded,
            self.flight_time_limit_exceeded,
            self.fd_critical_failure,
            self.fd_motor_failure,
            self.parachute_unhealthy,
            self.remote_id_unhealthy,
            self.fd_imbalanced_prop,
            self.local_position_invalid_relaxed,
            self.global_position_invalid_relaxed,
            self.battery_low_remaining_time,
            self.position_accuracy_low,
            self.fd_alt_loss,
            self.gnss_lost,
            self.navigator_failure,
            self.fd_esc_arming_failure,
            self.mode_req_local_position,
        )
