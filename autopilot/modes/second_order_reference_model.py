"""A place and its velocity, followed as a mass on a damped spring would (PX4 v1.18's lib/mathlib/math/filter).

SecondOrderReferenceModel with its bilinear discretisation. It has no longest step: flight tasks take none so long.
"""

from sitl_emu.autopilot.topics import NAN3, Vector3


class SecondOrderReferenceModel:
    """`state` and its `rate`; `reset` before the first update."""

    def __init__(self, natural_frequency: float, damping_ratio: float) -> None:
        """rad/s, and the share of critical damping."""
        self._spring = natural_frequency * natural_frequency
        self._damping = 2.0 * damping_ratio * natural_frequency
        self.state = self.rate = self._last_state = self._last_rate = NAN3

    def reset(self, state: Vector3, rate: Vector3) -> None:
        """Be there."""
        self.state = self._last_state = state
        self.rate = self._last_rate = rate

    def update(self, dt_s: float, state: Vector3, rate: Vector3) -> None:
        """One step towards the last samples; these are the next step's."""
        spring, damping = self._spring, self._damping
        share = 1.0 / (1.0 + 0.5 * damping * dt_s + 0.25 * spring * dt_s * dt_s)
        states, rates = [], []
        for x, v, to_x, to_v in zip(self.state, self.rate, self._last_state, self._last_rate, strict=True):
            acceleration = share * (spring * (to_x - x - 0.5 * dt_s * v) + damping * (to_v - v))
            states.append(x + dt_s * (v + 0.5 * dt_s * acceleration))
            rates.append(v + dt_s * acceleration)
        self.state, self.rate = (states[0], states[1], states[2]), (rates[0], rates[1], rates[2])
        self._last_state, self._last_rate = state, rate
