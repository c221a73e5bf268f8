"""failure: lets a part of the vehicle fail (PX4: systemcmds/failure)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, error, integer, warning
from sitl_emu.autopilot.shell.vehicle_command import send_for_result
from sitl_emu.core import dialect as mavlink

UNITS = {
    "gyro": mavlink.FAILURE_UNIT_SENSOR_GYRO,
    "accel": mavlink.FAILURE_UNIT_SENSOR_ACCEL,
    "mag": mavlink.FAILURE_UNIT_SENSOR_MAG,
    "baro": mavlink.FAILURE_UNIT_SENSOR_BARO,
    "gps": mavlink.FAILURE_UNIT_SENSOR_GPS,
    "optical_flow": mavlink.FAILURE_UNIT_SENSOR_OPTICAL_FLOW,
    "vio": mavlink.FAILURE_UNIT_SENSOR_VIO,
    "distance_sensor": mavlink.FAILURE_UNIT_SENSOR_DISTANCE_SENSOR,
    "airspeed": mavlink.FAILURE_UNIT_SENSOR_AIRSPEED,
    "battery": mavlink.FAILURE_UNIT_SYSTEM_BATTERY,
    "motor": mavlink.FAILURE_UNIT_SYSTEM_MOTOR,
    "servo": mavlink.FAILURE_UNIT_SYSTEM_SERVO,
    "avoidance": mavlink.FAILURE_UNIT_SYSTEM_AVOIDANCE,
    "rc_signal": mavlink.FAILURE_UNIT_SYSTEM_RC_SIGNAL,
    "mavlink_signal": mavlink.FAILURE_UNIT_SYSTEM_MAVLINK_SIGNAL,
}
TYPES = {
    "ok": mavlink.FAILURE_TYPE_OK,
    "off": mavlink.FAILURE_TYPE_OFF,
    "stuck": mavlink.FAILURE_TYPE_STUCK,
    "garbage": mavlink.FAILURE_TYPE_GARBAGE,
    "wrong": mavlink.FAILURE_TYPE_WRONG,
    "slow": mavlink.FAILURE_TYPE_SLOW,
    "delayed": mavlink.FAILURE_TYPE_DELAYED,
    "intermittent": mavlink.FAILURE_TYPE_INTERMITTENT,
}


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`failure [-i INSTANCE] UNIT TYPE`, where SYS_FAILURE_EN allows it."""
    if not vehicle.parameters["SYS_FAILURE_EN"]:
        yield error("failure", "Failure injection disabled by SYS_FAILURE_EN param.")
        return FAILURE
    if list(arguments) == ["help"]:
        yield _usage()
        return SUCCESS
    words, instance = list(arguments), 0
    if "-i" in words[:-1]:
        at = words.index("-i")
        instance = integer(words[at + 1]) & 0xFF
        del words[at : at + 2]
    if len(words) < 2:
        yield _usage()
        yield error("failure", "Not enough arguments.")
        return FAILURE
    unit, kind = UNITS.get(words[0]), TYPES.get(words[1])
    if unit is None:
        yield error("failure", f"Component '{words[0]}' not found")
        return FAILURE
    if kind is None:
        yield error("failure", f"Failure type '{words[1]}' not found")
        return FAILURE
    what = f"unit: {words[0]} ({unit}), type: {words[1]} ({kind}), instance: {instance}"
    yield warning("failure", f"inject failure {what}")
    result = send_for_result(vehicle, mavlink.MAV_CMD_INJECT_FAILURE, float(unit), float(kind), float(instance))
    if result == mavlink.MAV_RESULT_ACCEPTED:
        return SUCCESS
    yield error("failure", "Timeout waiting for ack" if result is None else f"Result: {result}")
    return FAILURE


def _usage() -> str:
    units, types = ("".join(f"- {name}\n" for name in names) for names in (UNITS, TYPES))
    return f"Usage: failure [-i INSTANCE] COMPONENT TYPE\n\nComponents:\n{units}\nFailure types:\n{types}"
