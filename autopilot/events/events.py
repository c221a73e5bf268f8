"""Events: what the autopilot tells ground stations in numbers, which they put into words (uORB event).

`events.json` beside this file holds id and argument types of every event of PX4 v1.18, and the numbers of their enums
(https://mavlink.io/en/services/events.html). An event has two log levels, one for people and one for the log; both are
those of the text that goes with it, but for the events in LEVELS.
"""

import functools
import json
import pathlib
from collections import deque
from typing import Any, Final, NamedTuple

from sitl_emu.autopilot.constants import Severity
from sitl_emu.core.c_types import STRUCT_CODES, Layout

TABLE = pathlib.Path(__file__).with_name("events.json")
KEPT = 64
"""Events that wait for the links; a round of checks sends a few dozen at most."""
PROTOCOL: Final = 8
DISABLED: Final = 9
"""The levels of events that ground stations read and do not show, and of those that are not logged."""
LEVELS: dict[str, tuple[int | None, int]] = {
    **dict.fromkeys(
        (
            "commander_arm_denied_resolve_failures",
            "commander_arm_denied_throttle_unsafe",
            "commander_arm_denied_calibrating",
            "commander_disarm_denied_not_landed",
            "commander_modeswitch_not_avail",
            "commander_mission_start_denied_no_mission",
            "commander_ctrl_high_latency_failed",
        ),
        (Severity.CRITICAL, Severity.INFO),
    ),
    **dict.fromkeys(
        (
            "commander_failsafe_enter",
            "commander_failsafe_enter_hold",
            "commander_failsafe_enter_generic",
            "commander_failsafe_enter_generic_hold",
            "commander_failsafe_enter_autopilot_disengaged",
        ),
        (Severity.CRITICAL, Severity.WARNING),
    ),
    "navigator_autotune_unsupported_ax": (Severity.WARNING, Severity.INFO),
    "navigator_fail_max_hagl": (Severity.ERROR, Severity.ERROR),
    "commander_failsafe_enter_generic_warn": (Severity.WARNING, Severity.WARNING),
    "commander_failsafe_enter_warn": (Severity.WARNING, Severity.WARNING),
    "commander_failsafe_enter_low_flight_time_warn": (Severity.WARNING, Severity.INFO),
    "commander_failsafe_enter_low_bat": (Severity.WARNING, Severity.INFO),
    "commander_failsafe_enter_crit_bat_warn": (Severity.CRITICAL, Severity.INFO),
    "commander_failsafe_enter_crit_low_bat_warn": (Severity.EMERGENCY, Severity.INFO),
    **dict.fromkeys(
        (
            "check_estimator_gnss_fusion_stopped",
            "check_estimator_gnss_fusion_started",
            "check_estimator_position_failure_imminent",
            "check_high_wind_warning",
            "commander_kill_sw_engaged",
        ),
        (None, Severity.INFO),
    ),
    "commander_gcs_lost": (Severity.WARNING, Severity.INFO),
    "commander_low_bat_shutdown": (Severity.EMERGENCY, Severity.WARNING),
    "commander_low_bat_shutdown_failed": (Severity.EMERGENCY, Severity.ERROR),
    **dict.fromkeys(
        (
            "commander_unsupported_arm_disarm_param",
            "commander_unsupported_auto_mode",
            "commander_unsupported_base_mode",
            "commander_unsupported_main_mode",
            "logger_storage_full",
            "mavlink_log_not_enough_bw",
            "mission_failed_to_read_wp",
            "mission_item_set_failed",
        ),
        (Severity.ERROR, Severity.ERROR),
    ),
    "navigator_takeoff_already_higher": (Severity.ERROR, Severity.INFO),
    **dict.fromkeys(
        (
            "navigator_mis_starts_w_landing",
            "navigator_mis_takeoff_too_low",
            "navigator_mis_takeoff_not_first",
            "navigator_mis_vtol_items",
            "navigator_mis_takeoff_missing",
            "navigator_mis_land_missing",
            "navigator_mis_takeoff_or_land_missing",
            "navigator_mis_add_land_or_rm_to",
            "navigator_mis_add_to_or_rm_land",
            "feasibility_mis_in_air_landing_req",
            "navigator_mis_geofence_violation",
            "navigator_reposition_outside_geofence",
            "navigator_change_altitude_outside_geofence",
            "navigator_course_change_altitude_outside_geofence",
            "commander_cal_cmd_denied",
        ),
        (Severity.ERROR, Severity.INFO),
    ),
    **dict.fromkeys(
        (
            "mc_pos_ctrl_tilt_set",
            "mc_pos_ctrl_land_tilt_set",
            "mc_pos_ctrl_cruise_set",
            "mc_pos_ctrl_man_vel_set",
            "mc_pos_ctrl_man_vel_back_set",
            "mc_pos_ctrl_man_vel_side_set",
            "mc_pos_ctrl_up_vel_set",
            "mc_pos_ctrl_down_vel_set",
            "mc_pos_ctrl_hover_thrust_set",
            "ekf2_mag_type_invalid",
        ),
        (Severity.WARNING, Severity.WARNING),
    ),
    "stick_gesture_disabled_by_arm_switch": (Severity.INFO, DISABLED),
    "commander_airmode_requires_no_arm_gesture": (Severity.ERROR, DISABLED),
    **dict.fromkeys(("mission_not_valid_refuse", "mission_not_valid_loiter"), (Severity.ERROR, DISABLED)),
    "navigator_mis_unsup_cmd": (Severity.ERROR, Severity.WARNING),
    "navigator_mis_first_wp_far": (Severity.WARNING, Severity.INFO),
    "navigator_geofence_invalid_against_home": (Severity.CRITICAL, Severity.WARNING),
    "navigator_geofence_invalid_against_cur_pos": (Severity.CRITICAL, Severity.WARNING),
    "mavlink_mission_req_ignored": (Severity.WARNING, Severity.WARNING),
    **dict.fromkeys(
        (
            "mavlink_mission_sync_timeout",
            "mavlink_mission_state_busy",
            "mavlink_mission_no_transfer",
            "mavlink_mission_mis_item_invalid",
            "mavlink_mission_mis_item_busy",
            "mavlink_mission_getlist_busy",
            "mavlink_mission_ignore_mis_count",
            "mavlink_mission_ignore_clear",
            "mavlink_mission_mis_req_ignored_busy",
            "mavlink_mission_partner_id_mismatch2",
            "mavlink_mission_item_partner_id_mismatch",
            "mavlink_mission_partner_id_mismatch",
            "mavlink_mission_wp_unexpected",
            "mavlink_mission_wp_unexpected2",
            "mavlink_mission_seq_out_of_bounds",
            "mavlink_mission_storage_failure",
        ),
        (Severity.ERROR, Severity.ERROR),
    ),
}
"""(for people, for the log); None: as it is sent."""


class Event(NamedTuple):
    """One event; `number` counts up, so that every link knows what it has sent."""

    number: int
    id: int
    log_levels: int
    """For the log in the high half, for people in the low one."""
    arguments: bytes


class Events:
    """The last events. Any module may send one; each link sends what is new to it."""

    def __init__(self) -> None:
        self.recent: deque[Event] = deque(maxlen=KEPT)
        self.count = 0

    def send(self, name: str, level: int, *arguments: float) -> None:
        """Send an event by its PX4 name. `level` is that of its text, or of itself where there is none.

        Raises KeyError for a name that PX4 does not know. Numbers that an argument cannot hold wrap around.
        """
        external, internal = LEVELS.get(name, (level, level))
        external = level if external is None else external
        event_id, formats = layout(name)
        log_levels = int(internal) << 4 | int(external)
        self.recent.append(Event(self.count, event_id, log_levels, pack(formats, arguments)))
        self.count += 1


def pack(formats: str, arguments: tuple[float, ...]) -> bytes:
    """Arguments as the wire wants them: one after the other, little-endian."""
    return Layout(formats).pack(*arguments)


@functools.cache
def layout(name: str) -> tuple[int, str]:
    """Id of an event and one struct code per argument; KeyError for an unknown name."""
    return _layouts()[name]


@functools.cache
def _layouts() -> dict[str, tuple[int, str]]:
    loaded = table()
    enums = {name.rsplit("::", 1)[-1]: row["type"] for name, row in loaded["enums"].items()}
    layouts = {}
    for name, row in loaded["events"].items():
        types = [kind.rsplit("::", 1)[-1] for _, kind in row["arguments"]]
        layouts[name] = (row["id"], "".join(STRUCT_CODES[enums.get(kind, kind)] for kind in types))
    return layouts


@functools.cache
def table() -> dict[str, dict[str, Any]]:
    """PX4 v1.18's table: `events` by name, their `enums`, and which modes belong to which of the `groups`."""
    loaded: dict[str, dict[str, Any]] = json.loads(TABLE.read_text())
    return loaded
