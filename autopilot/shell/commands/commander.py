"""commander: arms, disarms, changes modes, and says how things are (PX4: modules/commander).

Its commands go the way of a MAVLink command from inside; what the commander decides is not printed, as on PX4, but for
the texts that it tells everybody.
"""

import math
from collections.abc import Sequence

from sitl_emu.autopilot.flight_mode import FLIGHT_MODES
from sitl_emu.autopilot.shell.command import (
    DECIMAL,
    FAILURE,
    SUCCESS,
    Output,
    Vehicle,
    error,
    info,
    number,
    usage,
    warning,
)
from sitl_emu.autopilot.shell.commands.module import HELP, default_command
from sitl_emu.autopilot.shell.vehicle_command import broadcast, send
from sitl_emu.core import dialect as mavlink

FORCE = 21196.0
SHUTDOWN = 2.0
QUICK = 4.0
PAIRED_BY_COMPANION = 10.0
"""What is paired, param1 of START_RX_PAIR: PX4's own word for a ground station's link, which a companion pairs."""
CUSTOM_MODE = 1.0
MODES = {mode.shell_name: state for state, mode in FLIGHT_MODES.items() if mode.shell_name is not None}
CALIBRATIONS = {"gyro": 1, "mag": 2, "baro": 3, "accel": 5, "level": 5, "airspeed": 6, "esc": 7}
"""Which parameter of MAV_CMD_PREFLIGHT_CALIBRATION asks for it."""
ACTUATOR_GROUPS = ("roll", "pitch", "yaw", "tilt", "xthrust", "ythrust", "zthrust")
"""By ACTUATOR_TEST_GROUP."""
GROUP_VALUES = {"xthrust": 0.1, "ythrust": 0.1, "zthrust": -0.1}
"""Little thrust where nobody says how much, lest it takes off; 1 in other groups."""
CALIBRATION_VALUES = {"level": 2.0, "airspeed": 2.0}
COMMANDS = (
    ("start", ""),
    ("calibrate", "mag|baro|accel|gyro|level|esc|airspeed [quick]"),
    ("check", "run the checks before arming"),
    ("safety", "on|off"),
    ("actuator_group_test", "roll|pitch|yaw|tilt|xthrust|ythrust|zthrust [VALUE]"),
    ("arm", "-f without checks"),
    ("disarm", "-f in the air"),
    ("takeoff", ""),
    ("land", ""),
    ("transition", "to fixed wing and back"),
    ("mode", "|".join(MODES)),
    ("pair", "a remote control with its receiver"),
    ("termination", "end the flight"),
    ("set_ekf_origin", "LATITUDE LONGITUDE ALTITUDE"),
    ("set_heading", "DEGREES"),
    ("poweroff", ""),
    ("stop", ""),
    ("status", "armed or not, mode, failsafe"),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`commander COMMAND ...`."""
    command, *words = arguments or [""]
    if command == "status":
        return (yield from _status(vehicle))
    if command == "start":
        return (yield from default_command("commander", True, arguments))
    if command == "check":
        send(vehicle, mavlink.MAV_CMD_RUN_PREARM_CHECKS)
        passed = vehicle.topics.vehicle_status.pre_flight_checks_pass
        yield info("commander", f"Preflight check: {'OK' if passed else 'FAILED'}")
        return SUCCESS
    if command in ("arm", "disarm"):
        send(vehicle, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, float(command == "arm"), FORCE * (words[:1] == ["-f"]))
        return SUCCESS
    if command == "takeoff":
        if send(vehicle, mavlink.MAV_CMD_NAV_TAKEOFF):
            send(vehicle, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0, 0.0)
        return SUCCESS
    if command == "land":
        send(vehicle, mavlink.MAV_CMD_NAV_LAND)
        return SUCCESS
    if command == "transition":
        send(vehicle, mavlink.MAV_CMD_DO_VTOL_TRANSITION, float(mavlink.MAV_VTOL_STATE_FW), 0.0)
        return SUCCESS
    if command == "poweroff":
        send(vehicle, mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, SHUTDOWN)
        return SUCCESS
    if command == "termination":
        send(vehicle, mavlink.MAV_CMD_DO_FLIGHTTERMINATION, 1.0, 0.0)
        return SUCCESS
    if command == "pair":
        broadcast(vehicle, mavlink.MAV_CMD_START_RX_PAIR, PAIRED_BY_COMPANION)
        return SUCCESS
    if command == "safety":
        return (yield from _safety(vehicle, words))
    if command == "actuator_group_test":
        return (yield from _actuator_group_test(vehicle, words))
    if command == "mode" and words:
        return (yield from _mode(vehicle, words[0]))
    if command == "calibrate" and words:
        return (yield from _calibrate(vehicle, words))
    if command == "set_ekf_origin":
        return (yield from _set_ekf_origin(vehicle, words))
    if command == "set_heading":
        return (yield from _set_heading(vehicle, words))
    if command in ("mode", "calibrate"):
        yield error("commander", "missing argument")
    if command not in HELP:
        yield info("commander", "unknown command")
    yield usage("commander", COMMANDS)
    return FAILURE


def _status(vehicle: Vehicle) -> Output:
    status = vehicle.topics.vehicle_status
    yield info("commander", "Armed" if status.armed else "Disarmed")
    yield info("commander", f"prearm safety: {'Off' if status.safety_off else 'On'}")
    yield info("commander", f"navigation mode: {FLIGHT_MODES[status.nav_state].name}")
    yield info("commander", f"user intended navigation mode: {FLIGHT_MODES[status.nav_state_user_intention].name}")
    yield info("commander", f"in failsafe: {'yes' if status.failsafe else 'no'}")
    return SUCCESS


def _mode(vehicle: Vehicle, name: str) -> Output:
    nav_state = MODES.get(name)
    if nav_state is None:
        yield error("commander", f"argument {name} unsupported.")
        return SUCCESS
    mode = FLIGHT_MODES[nav_state]
    send(vehicle, mavlink.MAV_CMD_DO_SET_MODE, CUSTOM_MODE, float(mode.main_mode), float(mode.sub_mode))
    return SUCCESS


def _calibrate(vehicle: Vehicle, words: list[str]) -> Output:
    what, quick = words[0], words[1:2] == ["quick"]
    if what == "mag" and quick:
        if len(words) > 2 and not DECIMAL.fullmatch(words[2]):
            yield error("commander", f"Invalid heading value: {words[2]}")
            return FAILURE
        heading_deg = number(words[2]) if len(words) > 2 else 0.0
        send(vehicle, mavlink.MAV_CMD_FIXED_MAG_CAL_YAW, math.floor(heading_deg + 0.5) % 360.0)
        return SUCCESS
    parameter = CALIBRATIONS.get(what)
    if parameter is None:
        yield error("commander", f"argument {what} unsupported.")
        return FAILURE
    values = [0.0] * 7
    values[parameter - 1] = QUICK if what == "accel" and quick else CALIBRATION_VALUES.get(what, 1.0)
    send(vehicle, mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, *values)
    return SUCCESS


def _safety(vehicle: Vehicle, words: list[str]) -> Output:
    if words[:1] not in (["on"], ["off"]):
        yield error("commander", "invlaid argument, use [on|off]" if words else "missing argument")
        return FAILURE
    send(vehicle, mavlink.MAV_CMD_DO_SET_SAFETY_SWITCH_STATE, float(words[0] == "on"))
    return SUCCESS


def _actuator_group_test(vehicle: Vehicle, words: list[str]) -> Output:
    if not words or words[0] not in ACTUATOR_GROUPS:
        yield error("commander", f"argument {words[0]} unsupported." if words else "missing argument")
        return FAILURE
    group = ACTUATOR_GROUPS.index(words[0])
    value = GROUP_VALUES.get(words[0], 1.0)
    if len(words) > 1 and DECIMAL.fullmatch(words[1]):
        value = number(words[1])
    elif len(words) > 1:
        text = f'actuator_group_test: value "{words[1]}" is invalid. Using default {value:.1f}'
        yield warning("commander", text)
    send(vehicle, mavlink.MAV_CMD_ACTUATOR_GROUP_TEST, float(group), value)
    return SUCCESS


def _set_heading(vehicle: Vehicle, words: list[str]) -> Output:
    if not words:
        yield error("commander", "missing argument")
        return SUCCESS
    heading = (0.0, 0.0, number(words[0]), 0.0, 0.0, 0.0, math.nan)
    send(vehicle, mavlink.MAV_CMD_EXTERNAL_ATTITUDE_ESTIMATE, *heading)
    return SUCCESS


def _set_ekf_origin(vehicle: Vehicle, words: list[str]) -> Output:
    if len(words) < 3:
        yield error("commander", "missing argument")
        return SUCCESS
    latitude_deg, longitude_deg, altitude_m = (number(word) for word in words[:3])
    origin = (0.0, 0.0, 0.0, 0.0, latitude_deg, longitude_deg, altitude_m)
    send(vehicle, mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN, *origin)
    return SUCCESS
