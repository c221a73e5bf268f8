"""Actuator metadata (COMP_METADATA_TYPE_ACTUATORS): outputs, what they can drive, and the geometries of our vehicles.

From it a ground station makes its actuators page: which parameter assigns a motor to an output, where the motors are
and which way they turn, and within which values each may be tested (MAV_CMD_ACTUATOR_TEST).
"""

from typing import Any

VERSION = 2
OUTPUTS = 16
"""PX4's simulated outputs, PWM_MAIN_FUNC1 to 16."""
MULTIROTOR, ROVER_ACKERMANN = 0, 5
"""Values of CA_AIRFRAME."""
MOTORS, SERVOS, ACTUATOR_SETS, AUXILIARIES = 12, 15, 6, 6
FIRST_MOTOR, FIRST_SERVO, FIRST_ACTUATOR_SET, FIRST_AUXILIARY = 101, 201, 301, 407

FUNCTIONS = {
    0: "Disabled",
    1: "Constant Min",
    2: "Constant Max",
    **{FIRST_MOTOR + number: f"Motor {number + 1}" for number in range(MOTORS)},
    **{FIRST_SERVO + number: f"Servo {number + 1}" for number in range(SERVOS)},
    **{FIRST_ACTUATOR_SET + number: f"Actuator Set {number + 1}" for number in range(ACTUATOR_SETS)},
    400: "Landing Gear",
    401: "Parachute",
    402: "RC Roll",
    403: "RC Pitch",
    404: "RC Throttle",
    405: "RC Yaw",
    406: "RC Flaps",
    **{FIRST_AUXILIARY + number: f"RC AUX {number + 1}" for number in range(AUXILIARIES)},
    420: "Gimbal Roll",
    421: "Gimbal Pitch",
    422: "Gimbal Yaw",
    430: "Gripper",
    440: "Landing Gear Wheel",
    450: "Engine Ignition",
    451: "Engine Throttle",
    452: "Engine Choke",
    453: "Engine Starter",
}
"""Codes of PWM_MAIN_FUNCn (PX4's output functions)."""
NOT_TESTED = frozenset({0, 1, 2})


def content() -> dict[str, Any]:
    """Outputs, functions and geometries."""
    return {
        "version": VERSION,
        "outputs_v1": [{"label": "SIM", "subgroups": [_outputs()]}],
        "functions_v1": {str(code): _function(code, label) for code, label in FUNCTIONS.items()},
        "mixer_v1": {"actuator-types": _types(), "config": [_multirotor(), _rover_ackermann()]},
    }


def _outputs() -> dict[str, Any]:
    return {
        "per-channel-parameters": [
            {"label": "Function", "name": "PWM_MAIN_FUNC${i}", "function": "function"},
            {"label": "Reversed", "name": "PWM_MAIN_REV", "index-offset": -1, "show-as": "bitset"},
        ],
        "channels": [{"label": f"Channel {number}", "param-index": number} for number in range(1, OUTPUTS + 1)],
    }


def _function(code: int, label: str) -> dict[str, Any]:
    return {"label": label, **({"exclude-from-actuator-testing": True} if code in NOT_TESTED else {})}


def _types() -> dict[str, Any]:
    return {
        "DEFAULT": {"values": {"min": -1, "max": 1, "default": -1}},
        "motor": {
            "function-min": FIRST_MOTOR,
            "function-max": FIRST_MOTOR + MOTORS - 1,
            "label-index-offset": 1,
            "values": {"min": 0, "max": 1, "default-is-nan": True, "reversible": True},
            "per-item-parameters": [
                {"label": "Turns both ways", "name": "CA_R_REV", "function": "reversible", "show-as": "bitset"},
                {"label": "Slew rate", "name": "CA_R${i}_SLEW", "index-offset": 0, "advanced": True},
            ],
        },
        "servo": {
            "function-min": FIRST_SERVO,
            "function-max": FIRST_SERVO + SERVOS - 1,
            "label-index-offset": 1,
            "values": {"min": -1, "max": 1, "default": 0},
            "per-item-parameters": [
                {"label": "Slew rate", "name": "CA_SV${i}_SLEW", "index-offset": 0, "advanced": True}
            ],
        },
    }


def _multirotor() -> dict[str, Any]:
    position: list[dict[str, Any]] = [
        {"label": f"Position {axis}", "name": f"CA_ROTOR${{i}}_P{axis}", "function": f"pos{axis.lower()}"}
        for axis in "XYZ"
    ]
    position[2]["advanced"] = True
    turning = {
        "label": "Counter-clockwise",
        "name": "CA_ROTOR${i}_KM",
        "function": "spin-dir",
        "show-as": "true-if-positive",
    }
    motors = {
        "group-label": "Motors",
        "actuator-type": "motor",
        "count": "CA_ROTOR_COUNT",
        "required": True,
        "per-item-parameters": [*position, turning],
    }
    return {
        "option": f"CA_AIRFRAME=={MULTIROTOR}",
        "type": "multirotor",
        "title": "Multirotor",
        "actuators": [motors],
    }


def _rover_ackermann() -> dict[str, Any]:
    group = {"required": True, "count": 1, "per-item-parameters": []}
    drive = {**group, "group-label": "Drive", "actuator-type": "motor", "item-label-prefix": ["Throttle"]}
    steering = {**group, "group-label": "Steering", "actuator-type": "servo", "item-label-prefix": ["Steering"]}
    return {
        "option": f"CA_AIRFRAME=={ROVER_ACKERMANN}",
        "title": "Rover (Ackermann)",
        "actuators": [drive, steering],
    }
