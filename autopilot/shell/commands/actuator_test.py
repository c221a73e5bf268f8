"""actuator_test: turns single motors and servos (PX4: systemcmds/actuator_test)."""

from collections.abc import Sequence

from sitl_emu.autopilot.shell.command import (
    FAILURE,
    SUCCESS,
    WAIT,
    Output,
    Vehicle,
    info,
    integer,
    number,
    usage,
    warning,
)
from sitl_emu.autopilot.topics import ActuatorTest

MOTOR_1, SERVO_1 = 101, 201
MOTORS, SERVOS = 12, 8
MOTOR_VALUE, MOTOR_US, MOTOR_PAUSE_US = 0.15, 400_000, 600_000
SERVO_VALUE, SERVO_US, SERVO_PAUSE_US = 0.3, 800_000, 1_000_000
COMMANDS = (
    ("set", "-m MOTOR, -s SERVO or -f FUNCTION, -v VALUE (-1..1), -t SECONDS"),
    ("iterate-motors", "one after the other"),
    ("iterate-servos", "one after the other"),
)
OPTIONS = ("-m", "-s", "-f", "-v", "-t")


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`actuator_test COMMAND ...`. A test without a time limit, which a key ends on PX4, is refused."""
    options: dict[str, str] = {}
    names = []
    words = iter(arguments)
    for word in words:
        if word in OPTIONS:
            options[word] = next(words, "")
        else:
            names.append(word)
    if names == ["iterate-motors"]:
        return (yield from _iterate(vehicle, "Motor", MOTOR_1, MOTORS, MOTOR_VALUE, MOTOR_US, MOTOR_PAUSE_US))
    if names == ["iterate-servos"]:
        return (yield from _iterate(vehicle, "Servo", SERVO_1, SERVOS, SERVO_VALUE, SERVO_US, SERVO_PAUSE_US))
    if names != ["set"]:
        yield usage("actuator_test", COMMANDS)
        return SUCCESS
    function = integer(options.get("-f", "0"))
    if "-m" in options:
        function = MOTOR_1 - 1 + integer(options["-m"])
    elif "-s" in options:
        function = SERVO_1 - 1 + integer(options["-s"])
    value, timeout_us = number(options.get("-v", "")), int(min(number(options.get("-t", "0")), 1e6) * 1e6)
    problem = ""
    if "-v" not in options:
        problem = "Missing argument: value"
    elif not -1.0 <= value <= 1.0:
        problem = "value invalid"
    elif function <= 0:
        problem = "Missing argument: function"
    elif timeout_us <= 0:
        problem = "Missing argument: timeout"
    if problem:
        yield warning("actuator_test", problem)
        yield usage("actuator_test", COMMANDS)
        return FAILURE
    vehicle.topics.actuator_test = ActuatorTest(vehicle.now_us, function, value, timeout_us)
    return SUCCESS


def _iterate(vehicle: Vehicle, name: str, first: int, count: int, value: float, test_us: int, pause_us: int) -> Output:
    for index in range(count):
        yield info("actuator_test", f"{name} {index} ({value * 100.0:.0f}%)")
        vehicle.topics.actuator_test = ActuatorTest(vehicle.now_us, first + index, value, test_us)
        end_us = vehicle.now_us + pause_us
        while vehicle.now_us < end_us:
            yield WAIT
    return SUCCESS
