"""State, health, arming, commands, events, the computer's load (topics/commander.py, commands.py, system.py)."""

from sitl_emu.autopilot.commander.mode_requirements import SELECTABLE_MODES, VALID_MODES, requirement_masks
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.events.events import Event
from sitl_emu.autopilot.logger.packing import Pack, Row, Value, by_name, row, zeros
from sitl_emu.autopilot.topics import (
    ActuatorArmed,
    ConfigOverrides,
    CpuLoad,
    FailsafeFlags,
    FailureDetectorStatus,
    HomePosition,
    VehicleCommand,
    VehicleStatus,
)
from sitl_emu.autopilot.vehicle_kind import ROTARY_WING

DISARMED, ARMED = 1, 2
"""vehicle_status.arming_state."""
EVENT_ARGUMENTS = 25


def _places_of_home(home: HomePosition) -> tuple[Value, ...]:
    """On the globe and in the local frame; PX4 begins with zeros."""
    on_globe = (home.lat, home.lon, home.alt) if home.valid else (0.0, 0.0, 0.0)
    local = (home.x, home.y, home.z) if home.valid_lpos else (0.0, 0.0, 0.0)
    return (*on_globe, home.valid_lpos, *local)


home_position = by_name(
    "home_position",
    HomePosition,
    {"valid_alt": "valid", "valid_hpos": "valid"},
    ("lat", "lon", "alt", "valid_lpos", "x", "y", "z"),
    _places_of_home,
)
actuator_armed = by_name("actuator_armed", ActuatorArmed, {"timestamp": 0})
failure_detector_status = by_name(
    "failure_detector_status",
    FailureDetectorStatus,
    zeros("fd_ext", "fd_battery"),
)
"""What the failure detector does not watch (its docstring) it has not found either."""
config_overrides = by_name("config_overrides", ConfigOverrides, {"timestamp": 0})
failsafe_flags = by_name(
    "failsafe_flags",
    FailsafeFlags,
    {
        "timestamp": 0,
        **requirement_masks(),
        **zeros("vtol_fixed_wing_system_failure"),
    },
)
cpuload = by_name("cpuload", CpuLoad)


def _arming_and_type(record: VehicleStatus) -> tuple[Value, ...]:
    return (
        ARMED if record.armed else DISARMED,
        record.vehicle_kind.traits.vehicle_type,
        record.nav_state == NavState.OFFBOARD,
    )


STATUS: dict[str, float | str] = {
    "failsafe_defer_state": "failsafe_defer",
    "system_type": "mav_type",
    "component_id": 1,
    "power_input_valid": 1,
    "calibration_enabled": "calibrating",
    "valid_nav_states_mask": VALID_MODES,
    "can_set_nav_states_mask": SELECTABLE_MODES,
    "safety_button_available": "safety_off",
    **zeros("executor_in_charge", "hil_state", "high_latency_data_link_lost", "is_vtol", "is_vtol_tailsitter"),
    **zeros("in_transition_mode", "in_transition_to_fw", "usb_connected"),
}


def vehicle_status(system_id: int) -> Row:
    """A row of arming and mode of this system."""
    return by_name(
        "vehicle_status",
        VehicleStatus,
        STATUS | {"system_id": system_id},
        ("arming_state", "vehicle_type", "accepts_offboard_setpoints"),
        _arming_and_type,
    )


@row("vehicle_control_mode")
def vehicle_control_mode(pack: Pack, record: VehicleStatus) -> bytes:
    """Which controllers the mode asks for."""
    control = record.control_mode
    by_position = control.altitude or control.climb_rate or control.position or control.velocity
    return pack(
        record.timestamp,
        record.armed,
        by_position and record.vehicle_kind.traits.vehicle_type == ROTARY_WING,
        control.manual,
        control.auto,
        control.offboard,
        control.position,
        control.velocity,
        control.altitude,
        control.climb_rate,
        control.attitude,
        control.rates,
        control.allocation,
    )


# --- what no topic of ours holds -------------------------------------------------------------------------------

vehicle_command = by_name("vehicle_command", VehicleCommand, {"timestamp": 0})


@row("vehicle_command_ack")
def vehicle_command_ack(pack: Pack, record: tuple[VehicleCommand, CommandResult, bool]) -> bytes:
    """The answer to a command, and whether it is another's, but for the time."""
    command, (result, progress, result_param2), from_outside = record
    target = (command.source_component, result, progress, command.source_system)
    return pack(0, command.command, result_param2, *target, from_outside)


@row("event")
def event(pack: Pack, record: Event) -> bytes:
    """An event as it is sent, but for the time; its sequence number is its place."""
    arguments = record.arguments.ljust(EVENT_ARGUMENTS, b"\0")
    return pack(0, record.id, record.number + 1 & 0xFFFF, *arguments, record.log_levels)
