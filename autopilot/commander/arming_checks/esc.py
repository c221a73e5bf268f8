"""What speed controllers say (PX4's escCheck): whether all of them answer (COM_ARM_CHK_ESCS), whether all let their
motors turn (FD_ACT_EN), and how hot they are (ESC_TEMP_WARN_TH). They are present once one of them has been heard.

Left out: the current that a motor draws (MOTFAIL_*), which PX4 minds once it is not 0, and faults. SIH's speed
controllers tell neither (sih.cpp, publish_esc_status).
"""

from typing import Final

from sitl_emu.autopilot.commander.arming_checks.findings import ALL_MODES, NO_MODE, Component, Findings, Settings
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.topics import EscStatus, Topics

SILENT_US: Final = 400_000
"""ESC_TIMEOUT_US."""
ALLOWED_TO_START_US: Final = 3_000_000
COOLER_C: Final = 5.0
"""So much cooler it has to become before its heat is told again."""


class EscCheck:
    """Remembers whether the controllers are hot, and since when not all let their motors turn."""

    def __init__(self) -> None:
        self._is_hot = False
        self._stopped_us: int | None = None

    def check(self, now_us: int, topics: Topics, settings: Settings, findings: Findings) -> None:
        """All of it, in PX4's order."""
        status = topics.esc_status
        if not status.rpm:
            if settings.com_arm_chk_escs and now_us > ALLOWED_TO_START_US:
                _fail(findings, "check_escs_telem_missing", text="Preflight Fail: ESC telemetry missing")
            return
        findings.health_present |= Component.MOTORS_ESCS
        armed = topics.vehicle_status.armed
        if settings.com_arm_chk_escs and now_us > status.timestamp + SILENT_US:
            findings.fd_motor_failure = True
            _tell_silence(status, findings, armed=armed)
        if not armed or not settings.fd_act_en or status.armed_flags == status.online_flags:
            self._stopped_us = None
        elif self._stopped_us is None:
            self._stopped_us = now_us
        elif self._stopped_us + SILENT_US <= now_us:
            findings.fd_esc_arming_failure = True
            text = "ESC failure: Not all ESCs are armed. Land now!"
            _fail(findings, "check_escs_not_all_armed", text=text)
        if settings.esc_temp_warn_th_c > 0.0:
            self._feel(status, settings.esc_temp_warn_th_c, findings)

    def _feel(self, status: EscStatus, warned_from_c: float, findings: Findings) -> None:
        hottest_c = status.temperature_c
        if hottest_c > warned_from_c:
            event = "check_esc_over_temperature"
            for number in range(1, len(status.rpm) + 1):
                findings.health_failure(NO_MODE, Component.MOTORS_ESCS, Severity.WARNING, event, number, int(hottest_c))
        if hottest_c >= warned_from_c:
            self._is_hot = True
        elif hottest_c < warned_from_c - COOLER_C:
            self._is_hot = False
        if self._is_hot:
            findings.lasting_texts["High ESC temperature. Reduce throttle!"] = Severity.WARNING


def _tell_silence(status: EscStatus, findings: Findings, *, armed: bool) -> None:
    numbers = range(1, len(status.rpm) + 1)
    for number in numbers:
        _fail(findings, "check_escs_offline", number)
    names = "".join(f"ESC{number} " for number in numbers)
    findings.texts[f"{names}offline. {'Land now!' if armed else ''}\t"] = Severity.CRITICAL


def _fail(findings: Findings, event: str, *arguments: float, text: str = "") -> None:
    findings.health_failure(ALL_MODES, Component.MOTORS_ESCS, Severity.CRITICAL, event, *arguments, text=text)
