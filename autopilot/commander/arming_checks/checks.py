"""All checks in their order, and what their findings mean: who may arm, which mode can run, the bits of SYS_STATUS.

PX4's HealthAndArmingChecks (v1.18). Present, enabled and healthy bits are those of PX4's SITL, which also counts
parts as healthy that it does not have. What changed is reported at most every two seconds, the first time two seconds
after the start, as a round of events: a summary, one for each failure, and another summary, so that a ground station
sees the whole state at once. Texts go with it, all of them anew each time. A failsafe that is to be told has what waits
for its time reported at once, without texts (Report::report, reportIfUnreportedDifferences).
"""

from collections.abc import Callable
from typing import Final

from sitl_emu.autopilot.commander.arming_checks import (
    arm_permission,
    baro,
    battery,
    companion_computer,
    cpu_resource,
    esc,
    estimator,
    failure_detector,
    flight_time,
    geofence,
    gps,
    home_position,
    imu,
    logger,
    magnetometer,
    manual_control,
    mission,
    mode,
    navigator,
    offboard,
    open_drone_id,
    parachute,
    power,
    rally_point,
    rc_and_data_link,
    rc_calibration,
    required_sensors,
    system,
    traffic_avoidance,
    wind,
)
from sitl_emu.autopilot.commander.arming_checks.findings import (
    ABSOLUTE_PRESSURE,
    ACCEL,
    AHRS,
    ALL_MODES,
    ATTITUDE_STABILIZATION,
    BATTERY,
    GPS,
    GYRO,
    LOGGING,
    MAG,
    MOTOR_OUTPUTS,
    PREARM_CHECK,
    RC_RECEIVER,
    RECOVERY_SYSTEM,
    XY_POSITION_CONTROL,
    Component,
    Findings,
    Settings,
)
from sitl_emu.autopilot.commander.mode_requirements import ALL_MODES as ALL_NAV_STATES
from sitl_emu.autopilot.commander.mode_requirements import (
    PREVENT_ARMING_MODES,
    modes_that_need_local_position,
    runnable_modes,
)
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import DISABLED, PROTOCOL
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.sensor_calibration import is_calibrated, priority
from sitl_emu.autopilot.topics import HealthReport, Topics

Check = Callable[[int, Topics, Settings, Findings], None]
State = tuple[tuple[int, ...], tuple[int, ...], list[tuple[str, int]]]
REPORT_INTERVAL_US: Final = 2_000_000
RC_CHANNELS: Final = 18
"""input_rc_s::RC_INPUT_MAX_CHANNELS."""
PRESENT: Final = GYRO | ACCEL | MAG | ABSOLUTE_PRESSURE | XY_POSITION_CONTROL
"""Of every vehicle; MOTOR_OUTPUTS are healthy also where they are not present."""
WHILE_FOUND = (
    (Component.GPS, GPS),
    (Component.LOGGING, LOGGING),
    (Component.BATTERY, BATTERY),
    (Component.MOTORS_ESCS, MOTOR_OUTPUTS),
)
"""What comes and goes: a GPS while the estimator uses it, the logger while it writes, a battery that is connected,
speed controllers that have been heard."""
DIFFERENTIAL_PRESSURE: Final = 0x10
HEALTHY: Final = (
    PRESENT
    | BATTERY
    | GPS
    | DIFFERENTIAL_PRESSURE
    | ATTITUDE_STABILIZATION
    | MOTOR_OUTPUTS
    | AHRS
    | RC_RECEIVER
    | LOGGING
)
"""What is healthy until a check finds fault with it, also where it is not present."""
BLAMED = (
    (Component.GYRO, GYRO),
    (Component.ACCEL, ACCEL),
    (Component.MAGNETOMETER, MAG),
    (Component.ABSOLUTE_PRESSURE, ABSOLUTE_PRESSURE),
    (Component.GPS, GPS),
    (Component.ATTITUDE_ESTIMATE, ATTITUDE_STABILIZATION | AHRS),
    (Component.LOCAL_POSITION_ESTIMATE, XY_POSITION_CONTROL),
    (Component.REMOTE_CONTROL, RC_RECEIVER),
    (Component.BATTERY, BATTERY),
    (Component.MOTORS_ESCS, MOTOR_OUTPUTS),
)
"""Sensors that any failure of their component makes unhealthy, and so enabled: they are wanted, there or not.

PX4's mavlink/streams/SYS_STATUS.hpp.
"""


def all_checks() -> tuple[Check, ...]:
    """In PX4's order, which is that of the events; those that remember something begin anew."""
    return (
        imu.check,
        arm_permission.check,
        baro.check,
        companion_computer.check,
        cpu_resource.CpuResourceCheck().check,
        required_sensors.check_sight,
        esc.EscCheck().check,
        estimator.EstimatorCheck().check,
        gps.GpsCheck().check,
        failure_detector.check,
        navigator.check,
        logger.check,
        magnetometer.check,
        manual_control.check,
        home_position.check,
        mission.check,
        rally_point.check,
        offboard.check,
        mode.check,
        open_drone_id.check,
        parachute.check,
        power.check,
        rc_calibration.check,
        system.check,
        battery.BatteryCheck().check,
        wind.WindCheck().check,
        geofence.check,
        flight_time.FlightTimeCheck().check,
        rc_and_data_link.RcAndDataLinkCheck().check,
        traffic_avoidance.check,
        required_sensors.check_receivers,
    )


class HealthAndArmingChecks:
    """Runs the checks and keeps what they said."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send_event: SendEvent) -> None:
        self._topics = topics
        self._parameters = parameters
        self._say = say
        self._send_event = send_event
        self._findings = Findings()
        self._state: State = ((), (), [])
        """What a round of events would tell, as the last look found it."""
        self._unreported = False
        self._reported_us = 0
        self._version = -1
        self._settings = settings_of(parameters)
        self._checks = all_checks()
        self._told: set[str] = set()
        """Of the texts that last."""

    def update(self, now_us: int, *, force_report: bool = False, authorization_denied: bool = False) -> bool:
        """Run every check; replaces topics failsafe_flags and health_report. Whether what was found has been told.

        `force_report` tells all of it anew; `authorization_denied`: somebody wants to arm and has no leave.
        """
        topics = self._topics
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._settings = settings_of(self._parameters)
        flies = topics.vehicle_status.vehicle_kind.traits.flies
        findings = Findings(modes_that_need_local_position(flies=flies))
        findings.arm_authorization_denied = authorization_denied
        for check in self._checks:
            check(now_us, topics, self._settings, findings)
        flags = findings.flags()
        sticks_lost = topics.failsafe_flags.manual_control_signal_lost  # the modes' check is before that of sticks
        can_run = runnable_modes(flags._replace(manual_control_signal_lost=sticks_lost), flies=flies)
        can_arm = can_run & ~findings.arming_forbidden
        if not topics.vehicle_status.armed:  # who flies in one of them is told to be ready all the same (ModeChecks)
            can_arm &= ~PREVENT_ARMING_MODES
        nav_state = topics.vehicle_status.nav_state
        present = PRESENT
        present |= sum(bit for component, bit in WHILE_FOUND if findings.health_present & component)
        unhealthy = sum(bits for component, bits in BLAMED if findings.blamed & component)
        health = HEALTHY & ~unhealthy
        if can_arm >> nav_state & 1:
            health |= PREARM_CHECK
        topics.failsafe_flags = flags
        present |= 0 if flags.manual_control_signal_lost else RC_RECEIVER
        parachute = RECOVERY_SYSTEM if findings.health_present & Component.PARACHUTE else 0
        no_parachute = RECOVERY_SYSTEM if findings.blamed & Component.PARACHUTE else 0
        topics.health_report = HealthReport(
            now_us,
            present,
            present | unhealthy,
            health,
            parachute,
            parachute | no_parachute,
            RECOVERY_SYSTEM & ~no_parachute,
            can_arm,
            can_run,
        )
        for notice in findings.notices:
            self._send_event(notice.event, notice.level, *notice.arguments)
        state = self._state_of(findings, can_run)
        self._unreported = self._unreported or state != self._state
        self._state, self._findings = state, findings
        self._told &= findings.lasting_texts.keys()
        if not force_report and not (self._unreported and now_us - self._reported_us >= REPORT_INTERVAL_US):
            return False
        self._report(now_us)
        for text, severity in findings.texts.items():
            self._say(severity, text)
        for text, severity in findings.lasting_texts.items():
            if text not in self._told:
                self._told.add(text)
                self._say(severity, text)
        return True

    def report_what_waits(self, now_us: int) -> None:
        """Send the round of events that a recent one has held back."""
        if self._unreported:
            self._report(now_us)

    def can_arm(self, nav_state: NavState) -> bool:
        """Whether the vehicle may be armed in a mode."""
        return bool(self._topics.health_report.can_arm_mode_flags >> nav_state & 1)

    def can_run(self, nav_state: NavState) -> bool:
        """Whether a mode can be flown now."""
        return bool(self._topics.health_report.can_run_mode_flags >> nav_state & 1)

    def _state_of(self, findings: Findings, runnable: int) -> State:
        """Both summaries, and each failure with its modes."""
        can_run = can_arm = ALL_MODES & ~(ALL_NAV_STATES & ~runnable)
        for failure in findings.failures:
            can_arm &= ~failure.modes
        health = (findings.health_present, findings.health_error, findings.health_warning)
        arming = (findings.arming_error, findings.arming_warning, can_arm, can_run)
        return (arming, health, [(failure.event, failure.told_modes) for failure in findings.failures])

    def _report(self, now_us: int) -> None:
        """Send the round of events."""
        self._unreported, self._reported_us = False, now_us
        arming, health, _ = self._state
        send = self._send_event
        send("commander_arming_check_summary", PROTOCOL, 0, *arming)
        for failure in self._findings.failures:
            if failure.level != DISABLED:
                index = failure.component.bit_length() - 1
                send(failure.event, failure.level, failure.told_modes, index, *failure.arguments)
        send("commander_health_summary", PROTOCOL, 0, *health)


def settings_of(parameters: Parameters) -> Settings:
    """What the checks obey, as it is now."""
    return Settings(
        com_pos_fs_eph_m=float(parameters["COM_POS_FS_EPH"]),
        com_vel_fs_evh_m_s=float(parameters["COM_VEL_FS_EVH"]),
        com_of_loss_us=int(parameters["COM_OF_LOSS_T"] * 1e6),
        com_rc_loss_us=int(parameters["COM_RC_LOSS_T"] * 1e6),
        com_dl_loss_us=int(parameters["COM_DL_LOSS_T"] * 1e6),
        com_flt_time_max_us=int(parameters["COM_FLT_TIME_MAX"] * 1e6),
        com_arm_wo_gps=int(parameters["COM_ARM_WO_GPS"]),
        com_armable=int(parameters["COM_ARMABLE"]),
        com_arm_mag_str=int(parameters["COM_ARM_MAG_STR"]),
        com_arm_bat_min=float(parameters["COM_ARM_BAT_MIN"]),
        com_arm_mis_req=int(parameters["COM_ARM_MIS_REQ"]),
        sys_has_gps=int(parameters["SYS_HAS_GPS"]),
        sys_has_mag=int(parameters["SYS_HAS_MAG"]),
        sys_has_baro=int(parameters["SYS_HAS_BARO"]),
        cbrk_supply_chk=int(parameters["CBRK_SUPPLY_CHK"]),
        nav_dll_act=int(parameters["NAV_DLL_ACT"]),
        com_arm_odid=int(parameters["COM_ARM_ODID"]),
        com_arm_traff=int(parameters["COM_ARM_TRAFF"]),
        com_parachute=int(parameters["COM_PARACHUTE"]),
        com_power_count=int(parameters["COM_POWER_COUNT"]),
        com_arm_chk_escs=int(parameters["COM_ARM_CHK_ESCS"]),
        fd_act_en=int(parameters["FD_ACT_EN"]),
        esc_temp_warn_th_c=float(parameters["ESC_TEMP_WARN_TH"]),
        calibrated=frozenset(sensor for sensor in ("ACC", "GYRO", "MAG") if is_calibrated(parameters, sensor)),
        mag_enabled=priority(parameters, "MAG") > 0,
        com_rc_in_mode=int(parameters["COM_RC_IN_MODE"]),
        rc_channels=tuple(_rc_channel(parameters, number) for number in range(1, RC_CHANNELS + 1)),
        com_cc_temp_warn=float(parameters["COM_CC_TEMP_WARN"]),
        rtl_type=int(parameters["RTL_TYPE"]),
        com_pos_low_eph_m=float(parameters["COM_POS_LOW_EPH"]),
        com_pos_low_act=int(parameters["COM_POS_LOW_ACT"]),
        com_wind_warn=float(parameters["COM_WIND_WARN"]),
        com_wind_max=float(parameters["COM_WIND_MAX"]),
        com_wind_max_act=int(parameters["COM_WIND_MAX_ACT"]),
        com_gnssloss_act=int(parameters["COM_GNSSLOSS_ACT"]),
        sys_has_num_dist=int(parameters["SYS_HAS_NUM_DIST"]),
        sys_has_num_gnss=int(parameters["SYS_HAS_NUM_GNSS"]),
        sys_has_num_of=int(parameters["SYS_HAS_NUM_OF"]),
        com_cpu_max=float(parameters["COM_CPU_MAX"]),
        com_ram_max=float(parameters["COM_RAM_MAX"]),
    )


def _rc_channel(parameters: Parameters, number: int) -> tuple[float, float, float]:
    return (
        float(parameters[f"RC{number}_MIN"]),
        float(parameters[f"RC{number}_TRIM"]),
        float(parameters[f"RC{number}_MAX"]),
    )
