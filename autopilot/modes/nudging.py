"""What sticks change in modes that fly by themselves (MPC_AUTO_NUDGING): PX4 v1.18's FlightTaskAuto.

Bit 0: the yaw stick turns the vehicle, which then keeps that heading until the mode changes, or the navigator wants
another. Bit 1: it does so in a landing, where pitch and roll move the place, no farther than MPC_LAND_RADIUS from where
it began, and throttle stops the descent or makes it twice as fast.
"""

import math
from typing import Final

from sitl_emu.autopilot.constants import NavState, SetpointType
from sitl_emu.autopilot.events.texts import Say, SendEvent
from sitl_emu.autopilot.modes.stick_acceleration import StickAcceleration
from sitl_emu.autopilot.modes.sticks import Horizontal, StickYaw, expo_deadzone, north_east
from sitl_emu.autopilot.modes.trajectory_constraints import max_distance_to_circle, max_speed_from_distance
from sitl_emu.autopilot.modes.velocity_smoothing import EPSILON
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Topics, VehicleLocalPosition

YAW: Final = 1
LANDING: Final = 2
"""Bits of MPC_AUTO_NUDGING."""
TURNED_BY_STICK: Final = (SetpointType.POSITION, SetpointType.TAKEOFF, SetpointType.LOITER, SetpointType.LAND)
LEAST_SPEED_M_S: Final = 0.5
"""With room for less, sticks move a landing no nearer to the edge of its circle."""


class YawNudge:
    """The yaw stick; `is_active` from its first deflection on."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics = topics
        self._stick = StickYaw()
        self._nav_state = NavState.MANUAL
        self.is_active = False
        self.refresh(parameters)

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self._bits, self._dead_zone = int(value["MPC_AUTO_NUDGING"]), float(value["MAN_DEADZONE"])
        self._stick.max_rate, self._stick.time_constant_s = math.radians(value["MPC_MAN_Y_MAX"]), value["MPC_MAN_Y_TAU"]

    def update(self, kind: int, yaw: float, yawspeed: float, dt_s: float, *, holds: bool) -> tuple[float, float]:
        """Yaw (NaN while it turns) and its rate, of those that the mode wants; `kind`: the setpoint's type.

        `holds`: a stick that is let go keeps the heading; under a weather vane it does not (rcHelpModifyYaw).
        """
        topics = self._topics
        nav_state, sticks = topics.vehicle_status.nav_state, topics.manual_control_setpoint
        if nav_state != self._nav_state:
            self._nav_state, self.is_active = nav_state, False
        may = (self._bits & YAW and kind in TURNED_BY_STICK) or (self._bits & LANDING and kind == SetpointType.LAND)
        if not may or not sticks.valid:
            self.is_active = False
            return yaw, yawspeed
        deflection = expo_deadzone(sticks.yaw, self._dead_zone)
        self.is_active = self.is_active or abs(deflection) > EPSILON
        if not self.is_active or not (holds or abs(deflection) > EPSILON):
            return yaw, yawspeed
        self._stick.yaw = yaw
        self._stick.update(deflection, topics.vehicle_local_position.heading, dt_s)
        return self._stick.yaw, self._stick.yawspeed


class LandNudge:
    """Pitch, roll and throttle in a landing: where it goes down, and how fast."""

    def __init__(self, topics: Topics, parameters: Parameters, say: Say, send: SendEvent) -> None:
        self._topics = topics
        self._horizontal = StickAcceleration(topics, parameters, say, send)
        self._centre: Horizontal = (0.0, 0.0)
        self._deflection: Horizontal = (0.0, 0.0)
        self.refresh(parameters)

    def refresh(self, value: Parameters) -> None:
        """Copy the parameters."""
        self._may = bool(int(value["MPC_AUTO_NUDGING"]) & LANDING)
        self._dead_zone, self._radius_m = float(value["MAN_DEADZONE"]), float(value["MPC_LAND_RADIUS"])
        self._jerk, self._acceleration = float(value["MPC_JERK_MAX"]), float(value["MPC_ACC_HOR"])
        self._horizontal.refresh(value)

    def forget(self) -> None:
        """An AUTO mode is entered: how fast sticks moved the landing of another time is forgotten."""
        self._horizontal.begin()
        self._horizontal.reset((0.0, 0.0), (0.0, 0.0))

    def begin(self, place: Horizontal) -> None:
        """A landing begins, to this place."""
        self._centre = self._horizontal.position = place

    def takes_sticks(self) -> bool:
        """Whether it may, and there are any; asked before the others each time."""
        sticks = self._topics.manual_control_setpoint
        takes = self._may and sticks.valid
        if takes:
            self._deflection = self._expo(sticks.pitch), self._expo(sticks.roll)
        return takes

    @property
    def moves_place(self) -> bool:
        """Whether pitch or roll is deflected."""
        return math.hypot(*self._deflection) > EPSILON

    def share_of_speed(self) -> float:
        """None of the descent's speed at full throttle, twice of it at none."""
        return 1.0 - self._expo(self._topics.manual_control_setpoint.throttle)

    def update(
        self, now_us: int, heading: float, local: VehicleLocalPosition, dt_s: float
    ) -> tuple[Horizontal, Horizontal]:
        """Position (NaN while sticks move it) and velocity of the landing; pitch and roll are seen from `heading`."""
        horizontal, sticks, fastest = self._horizontal, self._deflection, math.inf
        if self._radius_m > EPSILON:
            direction = north_east(*sticks, heading)
            room_m = max_distance_to_circle((local.x, local.y), self._centre, self._radius_m, direction)
            fastest = 0.0
            if math.isfinite(room_m):
                fastest = max_speed_from_distance(self._jerk, self._acceleration, room_m, 0.0)
            if fastest < LEAST_SPEED_M_S:
                sticks = (0.0, 0.0)
        # StickAccelerationXY::setVelocityConstraint takes no notice of 0
        horizontal.velocity_constraint = fastest if fastest >= EPSILON else math.inf
        horizontal.update(now_us, *sticks, heading, dt_s)
        return horizontal.position, horizontal.velocity

    def _expo(self, stick: float) -> float:
        return expo_deadzone(stick, self._dead_zone)
