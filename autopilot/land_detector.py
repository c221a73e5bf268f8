"""Land detector: whether the vehicle stands on the ground.

PX4's land_detector (src/modules/land_detector, v1.18). A multicopter goes ground_contact -> maybe_landed -> landed,
each held for a time; the times are PX4's 0.35, 0.25 and 0.3 s, three times as long where a distance to ground was
measured before and is not now. Limits: LNDMC_Z_VEL_MAX, LNDMC_XY_VEL_MAX, LNDMC_ROT_MAX. A rover is in the air, as
PX4 sees it, once it was armed for 0.5 s; in a return, armed or not, it is so but within NAV_ACC_RAD of its home; it is
landed whenever it is told to land.
Free fall (throw launch) and LNDMC_ALT_GND's ground effect are left out.
"""

import math

from autopilot.constants import NavState, TakeoffState
from autopilot.flight_time import FlightTime
from autopilot.parameters import Parameters
from autopilot.topics import Topics, VehicleLandDetected
from sitl_emu.core.geodesy import distance_m

GROUND_CONTACT_S, MAYBE_LANDED_S, LANDED_S = 0.35, 0.25, 0.3
SLOWER_BEYOND_RANGE = 3.0
LOW_THRUST_SHARE, MINIMAL_THRUST_SHARE = 0.3, 0.1
"""Between MPC_THR_MIN (0) and hover (1): below, the vehicle can't be flying."""
LAND_SPEED_SHARE = 0.9
CLOSE_TO_GROUND_M = 1.0
ROVER_IN_AIR_S = 0.5
GYRO_WEIGHT = 0.2


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
        self._rover_in_air = Held(False)
        self._flight_time = FlightTime(parameters)
        self._rates = (0.0, 0.0, 0.0)
        self._measures_distance = False

    def update(self, now_us: int) -> None:
        """Run at 50 Hz."""
        topics = self._topics
        landed = topics.vehicle_land_detected.landed
        self._flight_time.update(now_us, armed=topics.actuator_armed.armed, landed=landed)
        if topics.vehicle_status.vehicle_type == "rover":
            landed = self._rover_landed(now_us)
            topics.vehicle_land_detected = VehicleLandDetected(now_us, landed, landed, landed)
            return
        if not topics.actuator_armed.armed:
            self._ground_contact, self._maybe_landed, self._landed = Held(True), Held(True), Held(True)
            topics.vehicle_land_detected = VehicleLandDetected(now_us)
            return
        distance_known = topics.vehicle_local_position.dist_bottom_valid
        self._measures_distance |= distance_known
        slower = SLOWER_BEYOND_RANGE if self._measures_distance and not distance_known else 1.0
        touching, still = self._touching()
        contact = self._ground_contact.update(now_us, touching, GROUND_CONTACT_S * slower)
        quiet = contact and still and self._thrust_below(MINIMAL_THRUST_SHARE) and not self._rotating()
        maybe_landed = self._maybe_landed.update(now_us, quiet, MAYBE_LANDED_S * slower)
        landed = self._landed.update(now_us, maybe_landed, LANDED_S * slower)
        topics.vehicle_land_detected = VehicleLandDetected(now_us, landed, maybe_landed, contact)

    def _touching(self) -> tuple[bool, bool]:
        """(It looks like ground contact, it does not move sideways)."""
        topics, parameters = self._topics, self._parameters
        local = topics.vehicle_local_position
        climb_limit = min(float(parameters["LNDMC_Z_VEL_MAX"]), LAND_SPEED_SHARE * float(parameters["MPC_LAND_SPEED"]))
        if self._landed.state or self._maybe_landed.state:
            climb_limit *= 2.5
        vertical = not local.v_z_valid or abs(local.vz) > climb_limit
        sideways = local.v_xy_valid and math.hypot(local.vx, local.vy) > parameters["LNDMC_XY_VEL_MAX"]
        takeoff = topics.takeoff_status.state
        if TakeoffState.DISARMED <= takeoff < TakeoffState.RAMPUP and self._controlled():
            return True, True
        far = local.dist_bottom_valid and local.dist_bottom > CLOSE_TO_GROUND_M
        low_thrust = self._thrust_below(LOW_THRUST_SHARE)
        speed_down = topics.vehicle_local_position_setpoint.vz
        descending = self._controlled() and speed_down >= 1.1 * parameters["LNDMC_Z_VEL_MAX"]
        stopped_by_ground = descending and not vertical
        contact = (low_thrust or stopped_by_ground) and not vertical and not sideways and not far
        return contact, not sideways

    def _controlled(self) -> bool:
        """Whether climb rate is controlled (not by sticks)."""
        return self._topics.vehicle_status.nav_state not in (NavState.MANUAL, NavState.STAB, NavState.ACRO)

    def _thrust_below(self, share: float) -> bool:
        parameters, topics = self._parameters, self._topics
        least, hover = float(parameters["MPC_THR_MIN"]), float(parameters["MPC_THR_HOVER"])
        if topics.hover_thrust_estimate.valid:
            hover = topics.hover_thrust_estimate.hover_thrust
        if not self._controlled():
            least = float(parameters["MPC_MANTHR_MIN"])
        return -topics.vehicle_rates_setpoint.thrust_body[2] <= least + (hover - least) * share

    def _rotating(self) -> bool:
        x, y, z = self._topics.vehicle_angular_velocity.xyz
        fx, fy, fz = self._rates
        fx, fy, fz = fx + GYRO_WEIGHT * (x - fx), fy + GYRO_WEIGHT * (y - fy), fz + GYRO_WEIGHT * (z - fz)
        self._rates = (fx, fy, fz)
        limit = math.radians(float(self._parameters["LNDMC_ROT_MAX"]))
        return abs(fx) > limit or abs(fy) > limit or abs(fz) > limit

    def _rover_landed(self, now_us: int) -> bool:
        return not self._rover_in_air.update(now_us, not self._rover_is_down(), ROVER_IN_AIR_S)

    def _rover_is_down(self) -> bool:
        topics = self._topics
        nav_state = topics.vehicle_status.nav_state
        if nav_state == NavState.AUTO_LAND:
            return True
        if nav_state == NavState.AUTO_RTL:
            target, place = topics.position_setpoint_triplet.current, topics.vehicle_global_position
            if not target.valid or not place.valid:
                return False
            return distance_m(place.lat, place.lon, target.lat, target.lon) < self._parameters["NAV_ACC_RAD"]
        return not topics.actuator_armed.armed
