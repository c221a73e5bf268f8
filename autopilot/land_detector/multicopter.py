"""Whether a multicopter stands on the ground: PX4's MulticopterLandDetector (src/modules/land_detector, v1.18).

It goes ground_contact -> maybe_landed -> landed, each held for a third of a second, or for a whole one where a distance
to ground was measured before and is not now. Ground contact asks for little thrust, no motion and, until it has landed,
an order to descend. Limits: LNDMC_Z_VEL_MAX, which is lowered to what landing speeds allow (parameters/corrections.py),
LNDMC_XY_VEL_MAX, LNDMC_ROT_MAX, LNDMC_ALT_GND.
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.control_mode import asked_for
from sitl_emu.autopilot.constants import NavState, TakeoffState
from sitl_emu.autopilot.flight_mode import modes_where
from sitl_emu.autopilot.land_detector.held import Held
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics

EACH_S: Final = 1.0 / 3.0
EACH_OUT_OF_RANGE_S: Final = 1.0
"""MulticopterLandDetector::_update_topics: land_detection_time / 3."""
LOW_THRUST_SHARE: Final = 0.3
LOW_THRUST_SHARE_KNOWN_HOVER: Final = 0.6
MINIMAL_THRUST_SHARE: Final = 0.1
"""Between MPC_THR_MIN (0) and hover (1), the second where the hover thrust is estimated (_get_ground_contact_state)."""
MANUAL_THRUST_MARGIN: Final = 0.01
DESCENT_SHARE: Final = 1.1
WIDER_WHEN_LANDED: Final = 2.5
CLOSE_TO_GROUND_M: Final = 1.0
BY_RANGE: Final = 1
"""vehicle_local_position.DIST_BOTTOM_SENSOR_RANGE."""
FREEFALL_M_S2: Final = 2.0
FREEFALL_S: Final = 0.3
MINIMAL_THRUST_S: Final = 8.0
FRESH_US: Final = 1_000_000
"""Older than this, a thrust setpoint or an estimate does not count."""
NO_CLIMB_RATE = modes_where(lambda mode: not mode.control.climb_rate)


class MulticopterLandDetector:
    """What flies by thrust alone."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._ground_contact, self._maybe_landed, self._landed = Held(True), Held(True), Held(True)
        self._freefall, self._minimal_thrust = Held(False), Held(False)
        self._measures_distance = False
        self._in_descend = False
        self._hover_thrust = math.nan
        self._hover_thrust_us = -FRESH_US
        self._knows_hover_thrust = False

    def update(self, now_us: int) -> tuple[bool, ...]:
        """landed, maybe_landed, ground_contact, freefall and in_ground_effect, at 83 Hz."""
        topics = self._topics
        armed, local = topics.actuator_armed.armed, topics.vehicle_local_position
        self._measures_distance |= bool(local.dist_bottom_sensor_bitfield & BY_RANGE)
        each_s = EACH_OUT_OF_RANGE_S if self._measures_distance and not local.dist_bottom_valid else EACH_S
        ax, ay, az = topics.vehicle_acceleration.xyz
        falls = self._freefall.update(now_us, ax * ax + ay * ay + az * az < FREEFALL_M_S2**2, FREEFALL_S)
        touches = self._touches(now_us)  # disarmed, too: whether it descends is known from it
        contact = self._ground_contact.update(now_us, not armed or touches, each_s)
        quiet = self._is_quiet(now_us, contact=contact, falls=falls)
        maybe_landed = self._maybe_landed.update(now_us, not armed or quiet, each_s)
        landed = self._landed.update(now_us, not armed or maybe_landed, each_s)
        return landed, maybe_landed, contact, falls, self._in_ground_effect(moves=self._moves_sideways())

    def details(self, now_us: int) -> tuple[bool, ...]:
        """What the states follow from."""
        return (
            self._in_descend,
            self._thrust_is_low(now_us),
            self._moves_vertically(),
            self._moves_sideways(),
            self._turns(),
            not self._is_far_from_ground(),
        )

    def _touches(self, now_us: int) -> bool:
        """What looks like ground contact."""
        topics, parameters = self._topics, self._parameters
        limit = float(parameters["LNDMC_Z_VEL_MAX"])
        contact = self._thrust_is_low(now_us)
        if self._climb_rate_is_controlled():
            self._in_descend = topics.trajectory_setpoint.velocity[2] >= DESCENT_SHARE * limit
            if not (self._maybe_landed.state or self._landed.state):
                contact = contact and self._in_descend
        else:
            self._in_descend = False
        moves = self._moves_vertically() or self._moves_sideways()
        return contact and not moves and not self._is_far_from_ground()

    def _moves_vertically(self) -> bool:
        """Or nobody can tell."""
        local, limit = self._topics.vehicle_local_position, float(self._parameters["LNDMC_Z_VEL_MAX"])
        limit *= WIDER_WHEN_LANDED if self._landed.state else 1.0
        by_velocity = local.v_z_valid and abs(local.vz) < limit
        return not (by_velocity or (local.z_valid and abs(local.z_deriv) < limit))

    def _is_far_from_ground(self) -> bool:
        local = self._topics.vehicle_local_position
        return self._measures_distance and local.dist_bottom_valid and local.dist_bottom >= CLOSE_TO_GROUND_M

    def _turns(self) -> bool:
        """About roll and pitch."""
        p, q, _ = self._topics.vehicle_angular_velocity.xyz
        limit = math.radians(float(self._parameters["LNDMC_ROT_MAX"]))
        return math.hypot(p, q) > limit * (WIDER_WHEN_LANDED if self._landed.state else 1.0)

    def _moves_sideways(self) -> bool:
        local = self._topics.vehicle_local_position
        return local.v_xy_valid and math.hypot(local.vx, local.vy) > self._parameters["LNDMC_XY_VEL_MAX"]

    def _climb_rate_is_controlled(self) -> bool:
        """flag_control_climb_rate_enabled of the mode."""
        nav_state = self._topics.vehicle_status.nav_state
        if nav_state is NavState.OFFBOARD:
            return asked_for(self._topics.offboard_setpoint).climb_rate
        return nav_state not in NO_CLIMB_RATE

    def _hover(self) -> float:
        return (
            self._hover_thrust if self._hover_thrust == self._hover_thrust else float(self._parameters["MPC_THR_HOVER"])
        )

    def _thrust(self, now_us: int) -> float:
        """Thrust that is asked for, 0..1, none where that is no number; NaN where nobody asks any more."""
        setpoint = self._topics.vehicle_thrust_setpoint
        if now_us - setpoint.timestamp >= FRESH_US:
            return math.nan
        thrust = -setpoint.xyz[2]
        return thrust if thrust == thrust else 0.0

    def _thrust_is_low(self, now_us: int) -> bool:
        estimate = self._topics.hover_thrust_estimate
        if estimate.valid:
            self._hover_thrust, self._hover_thrust_us = estimate.hover_thrust, now_us
        is_fresh = now_us - self._hover_thrust_us < FRESH_US
        if not self._in_descend or is_fresh:
            self._knows_hover_thrust = is_fresh
        least = float(self._parameters["MPC_THR_MIN"])
        share = LOW_THRUST_SHARE_KNOWN_HOVER if self._knows_hover_thrust else LOW_THRUST_SHARE
        return self._thrust(now_us) <= least + (self._hover() - least) * share

    def _is_quiet(self, now_us: int, *, contact: bool, falls: bool) -> bool:
        """What looks like standing there with idling motors."""
        topics, parameters = self._topics, self._parameters
        if self._climb_rate_is_controlled():
            least = float(parameters["MPC_THR_MIN"])
            limit = least + (self._hover() - least) * MINIMAL_THRUST_SHARE
        else:
            limit = float(parameters["MPC_MANTHR_MIN"]) + MANUAL_THRUST_MARGIN
        idles = self._thrust(now_us) <= limit
        idles_long = self._minimal_thrust.update(now_us, idles, MINIMAL_THRUST_S)
        rests = contact if topics.vehicle_local_position.v_z_valid else idles_long
        return idles and not falls and not self._turns() and rests

    def _in_ground_effect(self, *, moves: bool) -> bool:
        topics, height_m = self._topics, float(self._parameters["LNDMC_ALT_GND"])
        local, takeoff = topics.vehicle_local_position, topics.takeoff_status.state
        is_below = local.dist_bottom_valid and height_m > 0.0 and local.dist_bottom < height_m
        flies_low = is_below and takeoff == TakeoffState.FLIGHT
        return (self._in_descend and not moves) or flies_low or takeoff == TakeoffState.RAMPUP
