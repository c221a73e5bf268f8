"""Land detector: whether the vehicle stands on the ground.

PX4's land_detector (src/modules/land_detector, v1.18). A multicopter goes ground_contact -> maybe_landed -> landed,
each held for a third of a second, or for a whole one where a distance to ground was measured before and is not now.
Ground contact asks for little thrust, no motion and, until it has landed, an order to descend. Limits: LNDMC_Z_VEL_MAX,
which is lowered to what landing speeds allow, LNDMC_XY_VEL_MAX, LNDMC_ROT_MAX, LNDMC_ALT_GND. A rover is in the air, as
PX4 sees it, once it was armed for half a second; in a return, armed or not, it is so but within NAV_ACC_RAD of its
home; it is landed whenever it is told to land.
"""

import math

from autopilot.constants import NavState, TakeoffState
from autopilot.flight_time import FlightTime
from autopilot.parameters import Parameters
from autopilot.topics import Topics, VehicleLandDetected
from sitl_emu.core.geodesy import distance_m

EACH_S, EACH_OUT_OF_RANGE_S = 1.0 / 3.0, 1.0
"""MulticopterLandDetector::_update_topics: land_detection_time / 3."""
LOW_THRUST_SHARE, LOW_THRUST_SHARE_KNOWN_HOVER, MINIMAL_THRUST_SHARE = 0.3, 0.6, 0.1
"""Between MPC_THR_MIN (0) and hover (1), the second where the hover thrust is estimated (_get_ground_contact_state)."""
MANUAL_THRUST_MARGIN = 0.01
LANDING_SPEED_MARGIN = 1.2
DESCENT_SHARE = 1.1
WIDER_WHEN_LANDED = 2.5
CLOSE_TO_GROUND_M = 1.0
FREEFALL_M_S2, FREEFALL_S = 2.0, 0.3
MINIMAL_THRUST_S = 8.0
FRESH_US = 1_000_000
"""Older than this, a thrust setpoint or an estimate does not count."""
AT_REST_US = 1_000_000
MOVING_RAD_S = math.radians(3.0)
SHAKING_GYRO, SHAKING_ACCEL = 0.02, 1.2
"""Vibration metrics of vehicle_imu_status beyond which a vehicle is not at rest (LandDetector::UpdateVehicleAtRest)."""
ROVER_IN_AIR_S = 0.5
"""RoverLandDetector: set_hysteresis_time_from(true, 500_ms)."""
NO_CLIMB_RATE = frozenset((NavState.MANUAL, NavState.STAB, NavState.ACRO, NavState.TERMINATION))


class Held:
    """A condition that counts once it has held for a time; its end counts at once."""

    def __init__(self, state: bool) -> None:
        self.state = state
        self._since_us: int | None = None

    def update(self, now_us: int, condition: bool, for_s: float) -> bool:
        """The state now."""
        if not condition:
            self.state, self._since_us = False, None
        elif not self.state:
            if self._since_us is None:
                self._since_us = now_us
            self.state = now_us - self._since_us >= for_s * 1e6
        return self.state


class LandDetector:
    """Writer of vehicle_land_detected."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._ground_contact, self._maybe_landed, self._landed = Held(True), Held(True), Held(True)
        self._freefall, self._minimal_thrust = Held(False), Held(False)
        self._rover_in_air = Held(False)
        self._flight_time = FlightTime(parameters)
        self._measures_distance = False
        self._in_descend = False
        self._hover_thrust = math.nan
        self._hover_thrust_us = -FRESH_US
        self._knows_hover_thrust = False
        self._moved_us = 0
        self._version = -1

    def update(self, now_us: int) -> None:
        """Run at 50 Hz."""
        topics = self._topics
        landed, armed = topics.vehicle_land_detected.landed, topics.actuator_armed.armed
        self._flight_time.update(now_us, armed=armed, landed=landed)
        if topics.vehicle_status.vehicle_type == "rover":
            landed = self._rover_landed(now_us)
            states = (landed, landed, landed, False, False, landed and self._rests(now_us))
            if self._is_news(now_us, states):
                topics.vehicle_land_detected = VehicleLandDetected(now_us, *states)
            return
        if self._version != self._parameters.version:
            self._lower_limit()
        local = topics.vehicle_local_position
        self._measures_distance |= local.dist_bottom_valid
        each_s = EACH_OUT_OF_RANGE_S if self._measures_distance and not local.dist_bottom_valid else EACH_S
        ax, ay, az = topics.sensor_combined.accelerometer_m_s2
        falls = self._freefall.update(now_us, ax * ax + ay * ay + az * az < FREEFALL_M_S2**2, FREEFALL_S)
        contact = self._ground_contact.update(now_us, not armed or self._touches(now_us), each_s)
        quiet = self._is_quiet(now_us, contact=contact, falls=falls)
        maybe_landed = self._maybe_landed.update(now_us, not armed or quiet, each_s)
        landed = self._landed.update(now_us, not armed or maybe_landed, each_s)
        states = (
            landed,
            maybe_landed,
            contact,
            falls,
            self._in_ground_effect(moves=self._moves_sideways()),
            landed and self._rests(now_us),
        )
        if self._is_news(now_us, states):
            topics.vehicle_land_detected = VehicleLandDetected(
                now_us,
                *states,
                self._in_descend,
                self._thrust_is_low(now_us),
                self._moves_vertically(),
                self._moves_sideways(),
                self._turns(),
                not self._is_far_from_ground(),
            )

    def _is_news(self, now_us: int, states: tuple[bool, ...]) -> bool:
        """Once a second, and when one of the states has changed."""
        last = self._topics.vehicle_land_detected
        return last.timestamp == 0 or now_us - last.timestamp >= FRESH_US or states != last[1:7]

    def _lower_limit(self) -> None:
        """LNDMC_Z_VEL_MAX is at most what can be told from the slowest descent (_update_params)."""
        parameters = self._parameters
        most = min(parameters["MPC_LAND_CRWL"], parameters["MPC_LAND_SPEED"]) / LANDING_SPEED_MARGIN
        if parameters["LNDMC_Z_VEL_MAX"] > most:
            parameters.set("LNDMC_Z_VEL_MAX", most, notify=False)
        self._version = parameters.version

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
        return not local.v_z_valid or abs(local.vz) >= limit * (WIDER_WHEN_LANDED if self._landed.state else 1.0)

    def _is_far_from_ground(self) -> bool:
        local = self._topics.vehicle_local_position
        return local.dist_bottom_valid and local.dist_bottom >= CLOSE_TO_GROUND_M

    def _turns(self) -> bool:
        """About roll and pitch."""
        p, q, _ = self._topics.vehicle_angular_velocity.xyz
        limit = math.radians(float(self._parameters["LNDMC_ROT_MAX"]))
        return math.hypot(p, q) > limit * (WIDER_WHEN_LANDED if self._landed.state else 1.0)

    def _rests(self, now_us: int) -> bool:
        """It has neither turned nor shaken for a second (LandDetector::UpdateVehicleAtRest)."""
        p, q, r = self._topics.vehicle_angular_velocity.xyz
        imu = self._topics.vehicle_imu_status
        if p * p + q * q + r * r > MOVING_RAD_S * MOVING_RAD_S:
            self._moved_us = now_us
        elif imu.gyro_vibration_metric > SHAKING_GYRO or imu.accel_vibration_metric > SHAKING_ACCEL:
            self._moved_us = max(self._moved_us, imu.timestamp)
        return now_us - self._moved_us > AT_REST_US

    def _moves_sideways(self) -> bool:
        local = self._topics.vehicle_local_position
        return local.v_xy_valid and math.hypot(local.vx, local.vy) > self._parameters["LNDMC_XY_VEL_MAX"]

    def _climb_rate_is_controlled(self) -> bool:
        """flag_control_climb_rate_enabled of the mode."""
        nav_state = self._topics.vehicle_status.nav_state
        if nav_state is NavState.OFFBOARD:
            return self._topics.offboard_setpoint.trajectory is not None
        return nav_state not in NO_CLIMB_RATE

    def _hover(self) -> float:
        return (
            self._hover_thrust if self._hover_thrust == self._hover_thrust else float(self._parameters["MPC_THR_HOVER"])
        )

    def _thrust(self, now_us: int) -> float:
        """Thrust that is asked for, 0..1; none from before the vehicle was armed; NaN where nobody asks any more."""
        setpoint = self._topics.vehicle_rates_setpoint
        if setpoint.timestamp < self._topics.vehicle_status.armed_time:
            return 0.0
        return -setpoint.thrust_body[2] if now_us - setpoint.timestamp < FRESH_US else math.nan

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

    def _rover_landed(self, now_us: int) -> bool:
        return not self._rover_in_air.update(now_us, not self._rover_is_down(), ROVER_IN_AIR_S)

    def _rover_is_down(self) -> bool:
        topics = self._topics
        nav_state = topics.vehicle_status.nav_state
        if nav_state in (NavState.AUTO_LAND, NavState.DESCEND):
            return True
        if nav_state == NavState.AUTO_RTL:
            triplet, place = topics.position_setpoint_triplet, topics.vehicle_global_position
            target = triplet.current
            if not target.valid or not place.valid or triplet.next.valid:
                return False
            return distance_m(place.lat, place.lon, target.lat, target.lon) < self._parameters["NAV_ACC_RAD"]
        return not topics.actuator_armed.armed
