"""What a battery's voltage and current tell: its open-circuit voltage, and the resistance of its cells.

PX4's Battery (src/lib/battery/battery.cpp, v1.18): recursive least squares of V = V_oc - n R I that forgets. Without a
measured current (-1 A, as PX4 has it) nothing is learnt. BAT1_N_CELLS, BAT1_V_EMPTY, BAT1_V_CHARGED.
"""

import math
from typing import Final

FORGETTING: Final = 0.95
RESISTANCE_OHM: Final = 0.005
"""Of a cell, to begin with."""
OCV_VARIANCE: Final = 1.5
RESISTANCE_VARIANCE: Final = 0.1
"""Of a cell, to begin with."""
OCV_TIME_CONSTANT_S: Final = 1.0
SMALLEST_CURRENT_A: Final = 1.2e-7


class BatteryEstimator:
    """`resistance_ohm` of a cell, `ocv_v` filtered; and how well the last voltage was predicted."""

    def __init__(self, cells: int, voltage_v: float, current_a: float) -> None:
        self._cells = cells
        self._estimate = (voltage_v, RESISTANCE_OHM * cells)
        self._covariance = (OCV_VARIANCE * cells, 0.0, RESISTANCE_VARIANCE * cells)
        """Symmetric: voltage, both, resistance."""
        self.covariance_norm = _norm(self._covariance)
        self.resistance_ohm = RESISTANCE_OHM
        self.ocv_v = self.ocv_of(voltage_v, current_a)
        self.prediction_v = self.error_v = 0.0

    def ocv_of(self, voltage_v: float, current_a: float) -> float:
        """The voltage without load."""
        return voltage_v + self.resistance_ohm * self._cells * current_a

    def update(self, voltage_v: float, current_a: float, dt_s: float) -> None:
        """One measurement; learns while it makes the estimate better."""
        if not current_a > SMALLEST_CURRENT_A:
            return
        ocv, resistance = self._estimate
        a, b, c = self._covariance
        self.prediction_v = ocv - current_a * resistance
        self.error_v = voltage_v - self.prediction_v
        to_ocv, to_resistance = a - b * current_a, b - c * current_a
        size = FORGETTING + to_ocv - to_resistance * current_a
        gain_ocv, gain_resistance = to_ocv / size, to_resistance / size
        covariance = (
            (a - gain_ocv * to_ocv) / FORGETTING,
            (b - gain_ocv * to_resistance) / FORGETTING,
            (c - gain_resistance * to_resistance) / FORGETTING,
        )
        norm = _norm(covariance)
        if norm < self.covariance_norm:
            self._estimate = (ocv + gain_ocv * self.error_v, resistance + gain_resistance * self.error_v)
            self._covariance, self.covariance_norm = covariance, norm
            self.resistance_ohm = max(self._estimate[1] / max(self._cells, 1), 0.0)
        else:
            self._estimate = (voltage_v + resistance * current_a, resistance)
        weight = dt_s / (OCV_TIME_CONSTANT_S + dt_s)
        self.ocv_v += weight * (self.ocv_of(voltage_v, current_a) - self.ocv_v)


def _norm(covariance: tuple[float, float, float]) -> float:
    a, b, c = covariance
    return math.sqrt(a * a + 2.0 * b * b + c * c)
