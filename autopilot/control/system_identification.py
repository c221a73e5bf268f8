"""A model of one axis from what goes in and what comes out, and a rate controller for it.

What PX4's autotuning is built on (src/lib/system_identification and src/lib/pid_design, v1.18): both signals are
low-passed and freed of their mean, recursive least squares fit y(k) = -a1 y(k-1) - a2 y(k-2) + b0 u(k-1) + b1 u(k-2) +
b2 u(k-3), and T. Yamamoto, K. Fujii, M. Kaneda, "Design and implementation of a self-tuning PID controller" (1998)
gives the gains.
"""

import math
from typing import NamedTuple

from sitl_emu.core.c_types import quotient

COEFFICIENTS = 5
FIRST_VARIANCE = 10e3
SAMPLES_BEFORE_FIT = 6
HIGH_PASS_HZ = 0.5
FORGETTING_S = 60.0
FIRST_FITNESS = 10.0
FITNESS_S = 1.0
"""Time constant of the fitness' low-pass, and what it begins with."""
INTEGRAL_SHARE = 0.2
"""PX4 takes a fifth of the integral gain that the method gives."""


LEAST_CUTOFF = 0.001
"""Of the sampling rate, in PX4's low-pass filters."""


class PidGains(NamedTuple):
    """In standard form: u = k (1 + i/s + d s) e."""

    k: float
    i: float
    d: float


class LowPass:
    """Second-order Butterworth low-pass of a number; all passes where the cutoff is no frequency (LowPassFilter2p)."""

    def __init__(self, sample_hz: float, cutoff_hz: float) -> None:
        self._all_passes = not 0.0 < cutoff_hz < sample_hz / 2.0
        ohm = math.tan(math.pi * max(cutoff_hz / sample_hz, LEAST_CUTOFF)) if not self._all_passes else 1.0
        c = 1.0 + math.sqrt(2.0) * ohm + ohm * ohm
        self._b0 = ohm * ohm / c
        self._a1 = 2.0 * (ohm * ohm - 1.0) / c
        self._a2 = (1.0 - math.sqrt(2.0) * ohm + ohm * ohm) / c
        self._first = self._second = 0.0

    def reset(self, value: float) -> None:
        """As if it had always been this value."""
        self._first = self._second = value / (1.0 + self._a1 + self._a2)

    def update(self, value: float) -> float:
        """The filtered value after one more sample."""
        if self._all_passes:
            return value
        new = value - self._a1 * self._first - self._a2 * self._second
        filtered = self._b0 * (new + 2.0 * self._first + self._second)
        self._first, self._second = new, self._first
        return filtered


class SystemIdentification:
    """One axis at a time."""

    def __init__(self, sample_s: float, model_s: float, cutoff_hz: float) -> None:
        """Samples come every `sample_s`, the model is fitted every `model_s`."""
        rate_hz = 1.0 / sample_s
        self._filters = (LowPass(rate_hz, cutoff_hz), LowPass(rate_hz, cutoff_hz))
        self._high_pass = rate_hz / (rate_hz + math.tau * HIGH_PASS_HZ)
        self._keep = 1.0 - model_s / FORGETTING_S
        self._model_s, self._fitness_share = model_s, model_s / (FITNESS_S + model_s)
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self.coefficients = [0.0] * COEFFICIENTS
        self._p = [[FIRST_VARIANCE if row == column else 0.0 for column in range(5)] for row in range(5)]
        self._u, self._y = [0.0] * 4, [0.0] * 3
        self._low: tuple[float, float] | None = None
        self._passed = (0.0, 0.0)
        self._samples = 0
        self.innovation, self.fitness = 0.0, FIRST_FITNESS
        """What the model was wrong by, and how fast its coefficients change (updateFitness); for the log."""

    @property
    def started(self) -> bool:
        """It has seen a sample."""
        return self._low is not None

    @property
    def variances(self) -> tuple[float, ...]:
        """Of its coefficients."""
        return tuple(self._p[n][n] for n in range(COEFFICIENTS))

    @property
    def filtered(self) -> tuple[float, float]:
        """The newest sample as it is taken into the model: what went in, what came out."""
        return self._passed

    def sample(self, u: float, y: float) -> None:
        """What went in and what came out."""
        if self._low is None:
            for each, value in zip(self._filters, (u, y), strict=True):
                each.reset(value)
            self._low = (u, y)
            return
        low_u, low_y = self._filters[0].update(u), self._filters[1].update(y)
        share, (before_u, before_y), (passed_u, passed_y) = self._high_pass, self._low, self._passed
        self._passed = share * (passed_u + low_u - before_u), share * (passed_y + low_y - before_y)
        self._low = (low_u, low_y)

    def fit(self) -> None:
        """Take the newest sample into the model."""
        u, y = self._passed
        self._u, self._y = [*self._u[1:], u], [*self._y[1:], y]
        if self._samples < SAMPLES_BEFORE_FIT:
            self._samples += 1
            self._rate(0.0)
            return
        phi = (-self._y[1], -self._y[0], self._u[2], self._u[1], self._u[0])
        p, keep = self._p, self._keep
        gain = [sum(row[n] * phi[n] for n in range(5)) for row in p]
        whole = keep + sum(phi[n] * gain[n] for n in range(5))
        self._p = p = [[(p[r][c] - gain[r] * gain[c] / whole) / keep for c in range(5)] for r in range(5)]
        theta = self.coefficients
        self.innovation = innovation = self._y[2] - sum(phi[n] * theta[n] for n in range(5))
        self.coefficients = [
            theta[r] + innovation * sum(p[r][n] * phi[n] for n in range(COEFFICIENTS)) for r in range(COEFFICIENTS)
        ]
        self._rate(sum(abs(new - old) for new, old in zip(self.coefficients, theta, strict=True)))

    def _rate(self, change: float) -> None:
        self.fitness += self._fitness_share * (change / self._model_s - self.fitness)


def pid_gains(coefficients: list[float], model_s: float, rise_s: float, detuning: float) -> PidGains:
    """Gains for the model [a1, a2, b0, b1, b2] by generalised minimum variance, critically damped."""
    a1, a2, *b = coefficients
    rho = model_s / max(0.01, min(1.0, rise_s))
    p1, p2 = -2.0 * math.exp(-2.0 * rho), math.exp(-4.0 * rho)
    e1 = -a1 + p1 + 1.0
    f0 = -a1 * e1 + a1 - a2 + e1 + p2
    f1 = a1 * e1 - a2 * e1 + a2
    f2 = a2 * e1
    nu, slope = detuning + (e1 + 1.0) * sum(b), f1 + 2.0 * f2
    if abs(nu) < 1e-7:
        return PidGains(0.0, 0.0, 0.0)
    integral = quotient(-INTEGRAL_SHARE * (f0 + f1 + f2), model_s * slope)
    return PidGains(-slope / nu, integral, quotient(-model_s * f2, slope))
