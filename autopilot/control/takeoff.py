"""Smooth takeoff: motors spin up, then the allowed climb speed ramps from "no thrust" to full.

PX4's TakeoffHandling (src/modules/mc_pos_control/Takeoff, v1.18): COM_SPOOLUP_TIME, MPC_TKO_RAMP_T.
"""

from typing import Final

from sitl_emu.autopilot.constants import TakeoffState

GRAVITY_M_S2: Final = 9.80665
LEAST_GAIN: Final = 0.01
"""Of the velocity control: PX4 takes no less for the ramp (TakeoffHandling::generateInitialRampValue)."""


class TakeoffHandling:
    """`state` is a TakeoffState."""

    def __init__(self) -> None:
        self.state = TakeoffState.DISARMED
        self._armed_us: int | None = None
        self._progress = 0.0

    def update_state(self, now_us: int, armed: bool, landed: bool, want_takeoff: bool, spoolup_time_s: float) -> None:
        """Go as many steps further as hold by now."""
        if not armed:
            self.state, self._armed_us = TakeoffState.DISARMED, None
            return
        if self._armed_us is None:
            self._armed_us = now_us
        if self.state < TakeoffState.SPOOLUP:
            self.state = TakeoffState.SPOOLUP
        if self.state == TakeoffState.SPOOLUP and now_us - self._armed_us >= spoolup_time_s * 1e6:
            self.state = TakeoffState.READY_FOR_TAKEOFF
        if self.state == TakeoffState.READY_FOR_TAKEOFF and want_takeoff:
            self.state, self._progress = TakeoffState.RAMPUP, 0.0
        if self.state == TakeoffState.RAMPUP and self._progress >= 1.0:
            self.state = TakeoffState.FLIGHT
        if self.state == TakeoffState.FLIGHT and landed:
            self.state = TakeoffState.READY_FOR_TAKEOFF

    def update_ramp(self, dt_s: float, speed_up_m_s: float, ramp_time_s: float, velocity_p_gain: float) -> float:
        """Climb speed allowed now (m/s, negative while the vehicle is not yet to lift): up to `speed_up_m_s`."""
        if self.state < TakeoffState.RAMPUP:
            return 0.0
        if self.state > TakeoffState.RAMPUP:
            return speed_up_m_s
        self._progress = self._progress + dt_s / ramp_time_s if ramp_time_s > dt_s else 1.0
        if self._progress >= 1.0:
            return speed_up_m_s
        # At this speed the velocity controller asks for no thrust at all.
        lowest = -GRAVITY_M_S2 / max(velocity_p_gain, LEAST_GAIN)
        return lowest + self._progress * (speed_up_m_s - lowest)
