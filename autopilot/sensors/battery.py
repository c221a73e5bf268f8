"""battery_status: the battery's charge and what follows from it (PX4's src/lib/battery, v1.18).

The charge is what the simulator tells, low-passed, where PX4's follows from the voltage; with BAT1_CAPACITY it is fused
with what was drawn.
Its warning level (BAT_LOW_THR, BAT_CRIT_THR, BAT_EMERGEN_THR), the time that it lasts, its scale, and what an estimator
of its resistance and open-circuit voltage finds (`battery_estimator.py`).
"""

import math
from typing import Final

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.sensors.battery_estimator import BatteryEstimator
from sitl_emu.autopilot.topics import NAN, BatteryStatus, Topics
from sitl_emu.core.simulator_api import SimulatedBattery

CHARGE_TIME_CONSTANT_S: Final = 1.0
AVERAGE_CURRENT_TIME_CONSTANT_S: Final = 50.0
POWER_MODULE: Final = 0
"""BAT1_SOURCE of a battery like ours; with another nobody hears of it (Battery::publishBatteryStatus)."""
NO_DRAIN: Final = 0.0
"""Of SIM_BAT_DRAIN: PX4's start-up script starts its battery_simulator only with more (init.d-posix/rcS)."""
BATTERY_EVERY_US: Final = 10_000
"""How often PX4's simulated battery is published (BatterySimulator.hpp). A simulator measures ours less often, and what
it measured last is said again, so that who asks gets an answer as often."""
NEVER_US: Final = 1 << 62
RECOGNIZED_V: Final = 2.1
"""With less nothing is connected (Battery::updateBatteryStatus), such as a battery of no cells."""
UNKNOWN_CURRENT_A: Final = -1.0
"""How PX4's battery says that it has no current sensor."""
GREATEST_SCALE: Final = 1.3
LEAST_CURRENT_A: Final = 1e-3
SETTLES_US: Final = 2_000_000
"""A battery that was just connected is not trusted so long (Battery::updateBatteryStatus)."""
VOLTAGE_WEIGHT: Final = 0.03
"""Of the charge by voltage, each BATTERY_EVERY_US, where the battery is empty (Battery::estimateStateOfCharge)."""
SECONDS_PER_HOUR: Final = 3600.0


class Battery:
    """Writer of battery_status, as is mavlink/services/battery_status.py: what that writes stands for a moment."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self.runs = bool(parameters["SIM_BAT_DRAIN"] > NO_DRAIN)
        """Whether there is a battery of ours: decided at boot. Without, who tells of one from outside tells alone."""
        self._average_current_a = NAN
        self._estimator: BatteryEstimator | None = None
        self._cell_v = NAN
        self._by_voltage = NAN
        """The charge that PX4 reads off the voltage."""
        self._unconnected_us = 0
        self._measured_us, self._due_us = 0, NEVER_US
        self._status = BatteryStatus()
        """What was measured last."""

    def repeat(self, now_us: int) -> None:
        """Say again what was measured last, when it is time."""
        if now_us >= self._due_us:
            self._due_us = max(self._due_us + BATTERY_EVERY_US, now_us)
            self._topics.battery_status = self._status._replace(timestamp=now_us)

    def measured(self, now_us: int, message: SimulatedBattery, *, is_off: bool) -> None:
        """What the simulator measured; `is_off`: its failure was injected, it is empty."""
        if not self.runs or int(self._parameters["BAT1_SOURCE"]) != POWER_MODULE:
            self._due_us = NEVER_US
            return
        previous = self._status
        current_a = message.current
        known = current_a == current_a
        resting_a = float(self._parameters["BAT1_I_OVERWRITE"])
        if resting_a > 0.0 and not self._topics.vehicle_status.armed:
            known, current_a = True, resting_a  # whatever was measured (Battery::updateCurrent)
        told_a = current_a if known else UNKNOWN_CURRENT_A
        dt_s = (now_us - self._measured_us) * 1e-6 if previous.connected else 0.0
        self._measured_us = now_us
        if self._due_us == NEVER_US:
            self._due_us = now_us + BATTERY_EVERY_US
        drawn_mah = current_a * dt_s / 3.6 if known else 0.0
        voltage_v, charge = message.voltage, message.state_of_charge * 1e-2
        if is_off:
            cells, empty_v = int(self._parameters["BAT1_N_CELLS"]), float(self._parameters["BAT1_V_EMPTY"])
            voltage_v, charge = cells * empty_v, 0.0
        cells = int(self._parameters["BAT1_N_CELLS"])
        cell_v = voltage_v / max(cells, 1)
        estimator = self._estimator
        if not previous.connected or estimator is None:
            self._estimator = estimator = BatteryEstimator(cells, voltage_v, told_a)
            self._cell_v, self._by_voltage, self._unconnected_us = cell_v, charge, now_us
        else:
            weight = 1.0 - math.exp(-dt_s / CHARGE_TIME_CONSTANT_S)
            self._by_voltage += (charge - self._by_voltage) * weight
            self._cell_v += (cell_v - self._cell_v) * weight
            estimator.update(voltage_v, told_a, dt_s)
        charge = self._charge(now_us, previous, drawn_mah, dt_s)
        self._topics.battery_status = self._status = BatteryStatus(
            now_us,
            voltage_v >= RECOGNIZED_V,
            voltage_v,
            current_a,
            charge,
            previous.discharged_mah + drawn_mah,
            battery_warning(self._parameters, charge),
            time_remaining_s=self._time_remaining_s(told_a, charge, dt_s),
            current_average_a=self._average_current_a,
            scale=self._battery_scale(),
            cell_count=cells,
            internal_resistance_estimate=estimator.resistance_ohm,
            ocv_estimate=estimator.ocv_of(voltage_v, told_a),
            ocv_estimate_filtered=estimator.ocv_v,
            volt_based_soc_estimate=self._charge_of(estimator.ocv_v / max(cells, 1)),
            voltage_prediction=estimator.prediction_v,
            prediction_error=estimator.error_v,
            estimation_covariance_norm=estimator.covariance_norm,
            capacity=int(max(float(self._parameters["BAT1_CAPACITY"]), 0.0)),
        )

    def _charge(self, now_us: int, previous: BatteryStatus, drawn_mah: float, dt_s: float) -> float:
        """By voltage alone, or, of a known capacity, drawn towards that the more, the emptier it is
        (Battery::estimateStateOfCharge)."""
        by_voltage, capacity_mah = self._by_voltage, float(self._parameters["BAT1_CAPACITY"])
        if not capacity_mah > 0.0 or now_us <= self._unconnected_us + SETTLES_US:
            return by_voltage
        weight, steps = VOLTAGE_WEIGHT * (1.0 - by_voltage), max(1, round(dt_s * 1e6 / BATTERY_EVERY_US))
        drawn, charge = drawn_mah / capacity_mah / steps, previous.remaining
        for _ in range(steps):
            charge += weight * (by_voltage - charge) - drawn
        return max(0.0, min(charge, 1.0 - (previous.discharged_mah + drawn_mah) / capacity_mah))

    def _battery_scale(self) -> float:
        """How much the voltage has fallen from BAT1_V_CHARGED, within limits (Battery::computeScale)."""
        if not self._cell_v > 0.0:
            return 1.0
        return max(1.0, min(GREATEST_SCALE, float(self._parameters["BAT1_V_CHARGED"]) / self._cell_v))

    def _charge_of(self, cell_v: float) -> float:
        """0..1 between BAT1_V_EMPTY and BAT1_V_CHARGED."""
        empty_v, charged_v = float(self._parameters["BAT1_V_EMPTY"]), float(self._parameters["BAT1_V_CHARGED"])
        span_v = charged_v - empty_v
        return max(0.0, min(1.0, (cell_v - empty_v) / span_v)) if span_v > 0.0 else 0.0

    def _time_remaining_s(self, current_a: float, charge: float, dt_s: float) -> float:
        """Until empty at the average current in flight, at first BAT_AVRG_CURRENT (Battery::computeRemainingTime).

        A current that nobody measures (-1 A) counts as none, and the average fades away.
        """
        average_a = self._average_current_a
        if not average_a > LEAST_CURRENT_A:
            average_a = float(self._parameters["BAT_AVRG_CURRENT"])
        if self._topics.actuator_armed.armed and math.isfinite(current_a):
            average_a += (max(current_a, 0.0) - average_a) * (1.0 - math.exp(-dt_s / AVERAGE_CURRENT_TIME_CONSTANT_S))
        self._average_current_a = average_a
        capacity_mah = float(self._parameters["BAT1_CAPACITY"])
        if not capacity_mah > 0.0:
            return NAN
        return charge * capacity_mah * 1e-3 / max(average_a, LEAST_CURRENT_A) * SECONDS_PER_HOUR


def battery_warning(parameters: Parameters, remaining: float) -> int:
    """0 none, 1 low, 2 critical, 3 emergency."""
    # Thresholds are float32 values, a little above the numbers that they stand for.
    remaining += 1e-6
    if remaining < parameters["BAT_EMERGEN_THR"]:
        return 3
    if remaining < parameters["BAT_CRIT_THR"]:
        return 2
    return 1 if remaining < parameters["BAT_LOW_THR"] else 0
