"""MAV_CMD_ACTUATOR_TEST at the outputs: single motors and servos move while the vehicle is disarmed.

PX4's ActuatorTest in its mixer library (src/lib/mixer_module/actuator_test.cpp, v1.18). Several functions may be tested
at once; a new test puts the end of all off, which comes by its time-out. What no output carries is not noticed.
"""

import math
from collections.abc import Callable, Sequence

from sitl_emu.autopilot.control.mixer import output, turns_both_ways
from sitl_emu.autopilot.topics import ActuatorTest, Topics


class ActuatorTests:
    """The tests that run; writes nothing."""

    def __init__(self, topics: Topics) -> None:
        self._topics = topics
        self._seen: ActuatorTest = topics.actuator_test
        self._until_us = 0
        self._values: dict[int, float] = {}

    @property
    def due(self) -> bool:
        """A test runs, or has been asked for."""
        return bool(self._values) or self._topics.actuator_test is not self._seen

    def update(self, now_us: int, functions: Sequence[int]) -> bool:
        """Take a new request, and end by time; whether a test runs. `functions`: PWM_MAIN_FUNCn."""
        test = self._topics.actuator_test
        if test is not self._seen:
            self._seen = test
            if test.function not in functions:
                pass
            elif test.timeout_us > 0:
                self._values[test.function] = test.value
                self._until_us = now_us + test.timeout_us
            else:
                self._values.pop(test.function, None)
        if now_us > self._until_us:
            self._values.clear()
        return bool(self._values)

    def stop(self) -> None:
        """Forget the tests: the vehicle was armed."""
        self._values.clear()
        self._seen = self._topics.actuator_test

    def outputs(self, function: int, curve: Callable[[float], float], reversible_flags: int = 0) -> tuple[float, float]:
        """What an output of this function carries, as HIL_ACTUATOR_CONTROLS and as SERVO_OUTPUT_RAW has it.

        Motors 0..1, servos and motors that turn both ways -1..1. `curve` makes a motor's signal of a thrust.
        """
        reversible = turns_both_ways(function, reversible_flags)
        return output(function, self._values.get(function, math.nan), curve, reversible=reversible)
