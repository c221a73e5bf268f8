"""Multicopter control: moves data between topics and the control laws, at their rates.

What PX4's mc_pos_control, mc_hover_thrust_estimator, mc_att_control, mc_rate_control and control_allocator do around
their maths (src/modules, v1.18). Position control runs when the autopilot calls `update_position` (125 Hz), attitude
control with each attitude (250 Hz), rate control and allocation at every tick, each where the mode asks for it
(control_mode), whether the vehicle is armed or not: what rests is its outputs. STAB, ACRO and MANUAL fly by the sticks,
OFFBOARD by its attitude or rates where it has some, every other mode by trajectory_setpoint. In OFFBOARD by thrust and
torque only the allocation runs, whenever a torque comes; by direct actuators nothing does. Setpoints of before the mode
don't count there: until the first comes, what was there before goes on. In a termination nothing runs, and the outputs
stay.

Left out: in a termination the parachute.
"""

import math
from typing import Final

from sitl_emu.autopilot.commander.control_mode import control_mode, is_of_mode
from sitl_emu.autopilot.constants import NavState, Severity, TakeoffState
from sitl_emu.autopilot.control.control_power import ControlPower
from sitl_emu.autopilot.control.hover_thrust_estimator import HoverThrustEstimator, HoverThrustParameters
from sitl_emu.autopilot.control.manual_attitude import ManualAttitude
from sitl_emu.autopilot.control.mc_allocation import MulticopterAllocation
from sitl_emu.autopilot.control.mc_att_control import AttitudeReference, rates_setpoint
from sitl_emu.autopilot.control.mc_autotune import McAutotune
from sitl_emu.autopilot.control.mc_parameters import constrain
from sitl_emu.autopilot.control.mc_pos_control import (
    LEAST_HOVER_THRUST,
    MOST_HOVER_THRUST,
    Limits,
    PositionControl,
    PositionControlGains,
    States,
    attitude_of_thrust,
    complete,
    failsafe_setpoint,
)
from sitl_emu.autopilot.control.mc_rate_control import RateControl
from sitl_emu.autopilot.control.mc_states import LastSetpoint, VehicleStates, climb_velocity
from sitl_emu.autopilot.control.takeoff import TakeoffHandling
from sitl_emu.autopilot.estimator.imu_filter import alpha
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.flight_mode import NOTHING, ControlMode
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.parameters.subscription_interval import PARAMETER_UPDATE_INTERVAL_US, SubscriptionInterval
from sitl_emu.autopilot.topics import (
    NAN,
    NAN3,
    DirectActuator,
    OffboardSetpoint,
    RateCtrlStatus,
    TakeoffStatus,
    Topics,
    TrajectorySetpoint,
    Vector3,
    VehicleAttitudeSetpoint,
    VehicleLocalPositionSetpoint,
    VehicleRatesSetpoint,
    VehicleStatus,
    VehicleThrustSetpoint,
    VehicleTorqueSetpoint,
)

TICK_S: Final = 0.004
TILT_LIMIT_SLEW_RAD_S: Final = 0.2
VALID_US: Final = 200_000
"""So long the last setpoint that could be flown goes on where one can't."""
STAY_DOWN = TrajectorySetpoint(0, NAN3, NAN3, (0.0, 0.0, 100.0))
"""On the ground: a large acceleration down leaves no thrust."""
CLEAR_OF_GROUND_M: Final = 1.0
"""Farther from it than so the ground bears nothing (MulticopterHoverThrustEstimator.cpp)."""
FRESH_THRUST_US: Final = 20_000
"""A thrust older than so tells nothing of the hover thrust (there, too)."""
WARNS_EVERY_US: Final = 2_000_000
PWM_EVERY: Final = 5
STATUS_EVERY: Final = 50
"""Ticks; as often as PX4 logs control_allocator_status."""


class MulticopterControl:
    """Writer of takeoff_status, vehicle_local_position_setpoint, vehicle_attitude_setpoint, vehicle_rates_setpoint,
    vehicle_thrust_setpoint, vehicle_torque_setpoint, rate_ctrl_status, actuator_controls_status (control_power.py) and
    hover_thrust_estimate."""

    def __init__(self, topics: Topics, parameters: Parameters, texts: Texts) -> None:
        """`texts`: where the modules tell the ground, and the log."""
        self._topics, self._parameters, self._texts = topics, parameters, texts
        self._say = texts.of("mc_pos_control")
        self._warned_us = 0
        self._takeoff = TakeoffHandling()
        self._position = PositionControl()
        self._rate = RateControl()
        self._power = ControlPower(topics)
        self._manual = ManualAttitude(parameters)
        self._reference = AttitudeReference()
        self._reference_us = self._heading_resets = 0
        """When the setpoint was that it followed last."""
        self._valid = TrajectorySetpoint()
        self._controls_position, self._begun_us = False, 0
        """Whether it does, and since when it has done so, or not."""
        """The last setpoint that could be flown."""
        self._position_us = self._rate_us = 0
        self._tilt_limit = 0.0
        self._mode = NOTHING
        """Which controllers run: what these two ask for."""
        self._mode_of: tuple[VehicleStatus, OffboardSetpoint] | None = None
        self._attitude_us = 0
        """When the attitude was that was controlled last."""
        self._clear_of_ground = False
        """It has been more than a metre up since it last stood."""
        self._ticks = 0
        self._rates_setpoint = VehicleRatesSetpoint()
        self._rates: Vector3 = (0.0, 0.0, 0.0)
        """Rates of that setpoint, which was controlled last."""
        self._obeyed: VehicleTorqueSetpoint | DirectActuator | None = None
        """What of OFFBOARD has gone to the motors last."""
        self._battery_scale = 1.0
        """What thrust and torque are multiplied by."""
        self._vehicle_states, self._setpoint = VehicleStates(parameters), LastSetpoint()
        self._allocation = MulticopterAllocation(topics, parameters, texts)
        self.autotune = McAutotune(topics, parameters, self._say)
        self.started = (self._allocation.group_test, self.autotune)
        self._refresh()
        self._updates = SubscriptionInterval(PARAMETER_UPDATE_INTERVAL_US, parameters.version)
        self._hover = HoverThrustEstimator(self._hover_parameters)

    def _get(self, name: str) -> float:
        return float(self._parameters[name])

    def _refresh(self) -> None:
        constrain(self._parameters, self._say)
        self._refresh_position_control()
        self._refresh_attitude_control()
        self._allocation.refresh()

    def _refresh_position_control(self) -> None:
        get = self._get
        self._gains = PositionControlGains(
            get("MPC_XY_P"),
            get("MPC_Z_P"),
            get("MPC_XY_VEL_P_ACC"),
            get("MPC_XY_VEL_I_ACC"),
            get("MPC_XY_VEL_D_ACC"),
            get("MPC_Z_VEL_P_ACC"),
            get("MPC_Z_VEL_I_ACC"),
            get("MPC_Z_VEL_D_ACC"),
            get("MPC_THR_XY_MARG"),
            bool(get("MPC_ACC_DECOUPLE")),
        )
        self._speed_xy, self._speed_up, self._speed_down = (
            get("MPC_XY_VEL_MAX"),
            get("MPC_Z_VEL_MAX_UP"),
            get("MPC_Z_VEL_MAX_DN"),
        )
        self._thrust_min, self._thrust_max = get("MPC_THR_MIN"), get("MPC_THR_MAX")
        self._thrust_hover = get("MPC_THR_HOVER")
        self._tilt_air, self._tilt_land = math.radians(get("MPC_TILTMAX_AIR")), math.radians(get("MPC_TILTMAX_LND"))
        self._land_speed = min(get("MPC_LAND_SPEED"), self._speed_down)
        self._is_thrown = bool(get("COM_THROW_EN"))
        self._spoolup_time, self._ramp_time = get("COM_SPOOLUP_TIME"), get("MPC_TKO_RAMP_T")
        self._vehicle_states.refresh(self._parameters)
        self._hover_parameters = HoverThrustParameters(
            self._thrust_hover,
            get("HTE_HT_ERR_INIT"),
            get("HTE_HT_NOISE"),
            get("HTE_ACC_GATE"),
            get("HTE_THR_RANGE"),
            get("HTE_VZ_THR"),
            get("HTE_VXY_THR"),
        )

    def _refresh_attitude_control(self) -> None:
        get = self._get

        def three(name: str) -> Vector3:
            return get(name.format("ROLL")), get(name.format("PITCH")), get(name.format("YAW"))

        self._yaw_weight = max(0.0, min(1.0, get("MC_YAW_WEIGHT")))
        yaw_gain = get("MC_YAW_P") / self._yaw_weight if self._yaw_weight > 1e-4 else get("MC_YAW_P")
        self._attitude_gains = (get("MC_ROLL_P"), get("MC_PITCH_P"), yaw_gain)
        self._rate_limits = tuple_radians(three("MC_{}RATE_MAX"))
        k = three("MC_{}RATE_K")
        self._reference.set_parameters(get("MC_REF_W_N"), get("MC_REF_FF"), math.radians(get("MC_REF_FF_MAX")))
        rate = self._rate
        rate.gain_p, rate.gain_i = scaled(k, three("MC_{}RATE_P")), scaled(k, three("MC_{}RATE_I"))
        rate.gain_d, rate.gain_ff = scaled(k, three("MC_{}RATE_D")), three("MC_{}RATE_FF")
        rate.int_limit = (get("MC_RR_INT_LIM"), get("MC_PR_INT_LIM"), get("MC_YR_INT_LIM"))
        rate.yaw_torque_alpha = alpha(get("MC_YAW_TQ_CUTOFF"), TICK_S)
        self._scaled_by_battery = bool(get("MC_BAT_SCALE_EN"))
        self._manual.refresh(self._parameters)

    def _control_mode(self) -> ControlMode:
        status, offboard = self._topics.vehicle_status, self._topics.offboard_setpoint
        of = self._mode_of
        if of is None or of[0] is not status or of[1] is not offboard:
            self._mode_of = (status, offboard)
            self._mode = control_mode(status.nav_state, status.vehicle_kind.traits, offboard)
        return self._mode

    # --- position ------------------------------------------------------------------------------------------

    def update_position(self, now_us: int) -> None:
        """Position control, or the sticks, or an offboard attitude: whichever leads to an attitude setpoint."""
        if self._updates.updated(now_us, self._parameters.version):
            self._refresh()
            self._hover.set_parameters(self._hover_parameters)
        topics = self._topics
        self._allocation.check_for_motor_failures()
        status, landed = topics.vehicle_status, topics.vehicle_land_detected
        dt = max(0.002, min(0.04, (now_us - self._position_us) * 1e-6))
        self._position_us = now_us
        # In every mode: its filters know the velocity when one begins that controls it
        states = self._vehicle_states.update(topics.vehicle_local_position, dt)
        self._setpoint.update(topics.trajectory_setpoint, topics.vehicle_local_position)
        armed = topics.actuator_armed.armed
        mode = self._control_mode()
        controls_position = mode.velocity or mode.climb_rate  # flag_multicopter_position_control_enabled
        by_sticks = mode.manual and not controls_position
        want_takeoff = topics.vehicle_constraints.want_takeoff and controls_position
        takeoff = self._takeoff
        takeoff.update_state(now_us, armed, landed.landed, want_takeoff, self._spoolup_time)
        if armed and (not controls_position or self._is_thrown):
            takeoff.state = TakeoffState.FLIGHT
        flying = takeoff.state >= TakeoffState.FLIGHT
        if controls_position != self._controls_position:
            self._controls_position, self._begun_us = controls_position, now_us
            if not controls_position:
                self._setpoint.replace(TrajectorySetpoint())
        if controls_position:
            self._slew_tilt_limit(self._tilt_air if flying else self._tilt_land, dt)
        if topics.takeoff_status[1:] != (takeoff.state, self._tilt_limit):
            topics.takeoff_status = TakeoffStatus(now_us, int(takeoff.state), self._tilt_limit)
        self._update_hover_thrust(now_us, dt, armed)
        hover = topics.hover_thrust_estimate
        self._manual.follow(now_us, dt, status, landed.landed, hover.hover_thrust if hover.valid else None)
        if not by_sticks:
            self._manual.let_go(topics.vehicle_attitude.euler[2], topics.vehicle_local_position.unaided_heading)
        if controls_position:
            self._fly_trajectory(now_us, dt, states, flying, flying and landed.ground_contact)
            return
        self._position.reset_integral()
        if by_sticks:
            self._fly_sticks(now_us, dt, status.nav_state)
        elif mode.attitude:
            attitude = topics.offboard_setpoint.attitude
            if attitude is not None and is_of_mode(attitude.timestamp, status):
                topics.vehicle_attitude_setpoint = attitude

    def _slew_tilt_limit(self, target: float, dt: float) -> None:
        step = TILT_LIMIT_SLEW_RAD_S * dt
        self._tilt_limit += max(-step, min(step, target - self._tilt_limit))

    def _fly_trajectory(self, now_us: int, dt: float, states: States, flying: bool, touching: bool) -> None:
        topics, control, takeoff = self._topics, self._position, self._takeoff
        setpoint, constraints = self._setpoint.value, topics.vehicle_constraints
        local = topics.vehicle_local_position
        if setpoint.timestamp < self._begun_us:  # nobody has asked for anything since: wait, and warn of nothing
            setpoint = failsafe_setpoint(states, self._land_speed)._replace(timestamp=now_us)
            self._setpoint.replace(setpoint)
        if takeoff.state == TakeoffState.RAMPUP and setpoint.velocity[2] == setpoint.velocity[2]:
            # what is fed forward does not lift it off before its ramp
            setpoint = setpoint._replace(acceleration=(*setpoint.acceleration[:2], NAN))
        if takeoff.state < TakeoffState.RAMPUP or touching:
            setpoint = STAY_DOWN._replace(timestamp=now_us)
            self._setpoint.replace(setpoint)
            control.reset_integral()
        speed_up, speed_down = constraints.speed_up, constraints.speed_down
        if not speed_up <= self._speed_up:
            speed_up = self._speed_up
        if speed_down != speed_down:
            speed_down = self._speed_down
        speed_up = takeoff.update_ramp(dt, speed_up, self._ramp_time, self._gains.z_vel_p)
        limits = Limits(
            local.vxy_max if local.vxy_max < self._speed_xy else self._speed_xy,
            min(speed_up, self._speed_up),
            max(speed_down, 0.0),
            self._thrust_min if flying else 0.0,
            self._thrust_max,
            self._tilt_limit,
        )
        vn, ve, vd = states.velocity
        states = states._replace(velocity=(vn, ve, climb_velocity(setpoint, local, vd, self._land_speed)))
        if complete(setpoint, states):
            self._valid = setpoint
        elif now_us < self._valid.timestamp + VALID_US and complete(self._valid, states):
            setpoint = self._valid
        else:
            setpoint = failsafe_setpoint(states, self._land_speed)
            self._warn_of_failsafe(now_us, states)
            limits = limits._replace(speed_xy=self._speed_xy, speed_up=self._speed_up, speed_down=self._speed_down)
        if not _has_horizontal(setpoint):
            control.reset_integral_xy()
        thrust = control.update(setpoint, states, self._gains, limits, dt)
        yaw = setpoint.yaw if setpoint.yaw == setpoint.yaw else states.yaw
        yaw_rate = setpoint.yawspeed if setpoint.yawspeed == setpoint.yawspeed else 0.0
        q_d, size = attitude_of_thrust(thrust, yaw)
        vn, ve, vd = control.velocity_sp
        x, y, z = setpoint.position
        topics.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint(
            now_us, x, y, z, vn, ve, vd, control.acceleration_sp, thrust, yaw, yaw_rate
        )
        topics.vehicle_attitude_setpoint = VehicleAttitudeSetpoint(now_us, q_d, yaw_rate, (0.0, 0.0, -size))

    def _warn_of_failsafe(self, now_us: int, states: States) -> None:
        """Into the log, from time to time (generateFailsafeSetpoint)."""
        if now_us - self._warned_us <= WARNS_EVERY_US:
            return
        self._warned_us = now_us
        vn, _, vd = states.velocity
        lines = ["invalid setpoints", "Failsafe: stop and wait" if vn == vn else "Failsafe: blind land"]
        if vd != vd:
            lines.append("Failsafe: blind descent")
        for line in lines:
            self._texts.note(Severity.WARNING, f"[mc_pos_control] {line}")

    def _update_hover_thrust(self, now_us: int, dt: float, armed: bool) -> None:
        """While it is well clear of the ground; on the ground MPC_THR_HOVER counts."""
        topics, estimator, control = self._topics, self._hover, self._position
        local = topics.vehicle_local_position
        if topics.vehicle_land_detected.landed:
            self._clear_of_ground = False
            control.hover_thrust = max(LEAST_HOVER_THRUST, min(MOST_HOVER_THRUST, self._thrust_hover))
        elif not local.dist_bottom <= CLEAR_OF_GROUND_M:
            self._clear_of_ground = True
        if not (armed and self._clear_of_ground and local.az == local.az):
            estimator.stop(now_us, armed)
            topics.hover_thrust_estimate = estimator.estimate
            return
        _, x, y, _ = topics.vehicle_attitude.q
        told = topics.vehicle_thrust_setpoint
        thrust = -(told.xyz[2] - self._allocation.unallocated_thrust) * (1.0 - 2.0 * (x * x + y * y))
        if thrust != thrust or now_us - told.timestamp >= FRESH_THRUST_US:
            return
        estimator.update(now_us, dt, -local.az, thrust, abs(local.vz), math.hypot(local.vx, local.vy))
        topics.hover_thrust_estimate = estimator.estimate
        if estimator.estimate.valid:
            control.update_hover_thrust(estimator.hover_thrust)

    # --- sticks --------------------------------------------------------------------------------------------

    def _fly_sticks(self, now_us: int, dt: float, nav_state: NavState) -> None:
        topics = self._topics
        sticks = topics.manual_control_setpoint
        if nav_state == NavState.ACRO:
            self._manual.let_go(topics.vehicle_attitude.euler[2], topics.vehicle_local_position.unaided_heading)
            self._set_rates(now_us, self._manual.rates(now_us, sticks))
            return
        heading, unaided = topics.vehicle_attitude.euler[2], topics.vehicle_local_position.unaided_heading
        topics.vehicle_attitude_setpoint = self._manual.attitude(now_us, dt, sticks, heading, unaided)

    # --- attitude, rates, motors -----------------------------------------------------------------------------

    def update_rate(self, now_us: int) -> None:
        """Attitude control with each new attitude; rate control and allocation."""
        dt = (now_us - self._rate_us) * 1e-6
        self._rate_us = now_us
        if not 0.0 < dt < 0.02:
            dt = TICK_S
        mode = self._control_mode()
        attitude_us = self._topics.vehicle_attitude.timestamp
        if attitude_us != self._attitude_us:
            self._attitude_us = attitude_us
            if mode.attitude:
                self._control_attitude(now_us)
            elif mode.rates and mode.offboard:
                self._take_rates(now_us)
        if mode.rates:
            self._control_rates(now_us, dt)
        elif mode.offboard:
            self._obey(now_us, self._topics.offboard_setpoint, self._topics.vehicle_status)

    def _control_rates(self, now_us: int, dt: float) -> None:
        topics, rate = self._topics, self._rate
        setpoint, rates = topics.vehicle_rates_setpoint, topics.vehicle_angular_velocity
        landed = topics.vehicle_land_detected
        if not topics.actuator_armed.armed:
            rate.reset_integral()
        if setpoint is not self._rates_setpoint:
            self._rates_setpoint, self._rates = setpoint, known_rates(setpoint.rates, rates.xyz)
        roll, pitch, yaw = rate.update(
            rates.xyz,
            self._rates,
            rates.xyz_derivative,
            dt,
            landed.landed or landed.maybe_landed,
            self._allocation.unallocated,
        )
        thrust = setpoint.thrust_body[2]
        if self._scaled_by_battery:
            self._follow_battery()
            roll, pitch, yaw = self._by_battery((roll, pitch, yaw))
            _, _, thrust = self._by_battery(setpoint.thrust_body)
        self._power.add(now_us, (roll, pitch, yaw), dt)
        if self.autotune.rates is not None:
            self.autotune.on_torque((roll, pitch, yaw), rates.xyz)
        self._ticks += 1
        told = self._ticks % PWM_EVERY == 0
        if told:
            topics.vehicle_torque_setpoint = VehicleTorqueSetpoint(now_us, (roll, pitch, yaw))
            topics.rate_ctrl_status = RateCtrlStatus(now_us, *rate.integral)
        self._allocate(now_us, (roll, pitch, yaw), thrust, told)

    def _follow_battery(self) -> None:
        """The last scale that a battery told stays."""
        battery = self._topics.battery_status
        if battery.connected and battery.scale > 0.0:
            self._battery_scale = battery.scale

    def _by_battery(self, setpoint: Vector3) -> Vector3:
        """An empty battery turns the motors more slowly than a full one: so much more is asked of it. NaN stays NaN."""
        scale = self._battery_scale
        x, y, z = setpoint
        return max(min(x * scale, 1.0), -1.0), max(min(y * scale, 1.0), -1.0), max(min(z * scale, 1.0), -1.0)

    def _allocate(self, now_us: int, torque: Vector3, thrust: float, told: bool) -> None:
        status_told = self._ticks % STATUS_EVERY == 0
        self._allocation.allocate(now_us, torque, thrust, told=told, status_told=status_told)

    def _obey(self, now_us: int, offboard: OffboardSetpoint, status: VehicleStatus) -> None:
        """OFFBOARD that goes round the rate controller, or round all. What is not told anew stays."""
        topics, direct, asked = self._topics, offboard.direct_actuator, offboard.thrust_and_torque
        if direct is not None:
            if direct is not self._obeyed and is_of_mode(direct.motors.timestamp, status):
                self._obeyed = direct
                self._allocation.obey(now_us, direct)
        elif asked is not None:
            if is_of_mode(asked.thrust.timestamp, status):
                topics.vehicle_thrust_setpoint = asked.thrust
            if asked.torque is not self._obeyed and is_of_mode(asked.torque.timestamp, status):
                self._obeyed = topics.vehicle_torque_setpoint = asked.torque
                self._ticks += 1
                self._allocate(now_us, asked.torque.xyz, topics.vehicle_thrust_setpoint.xyz[2], True)

    def _take_rates(self, now_us: int) -> None:
        """OFFBOARD by rates."""
        rates, present = self._topics.offboard_setpoint.rates, self._topics.vehicle_rates_setpoint
        told = rates is not None and is_of_mode(rates.timestamp, self._topics.vehicle_status)
        self._set_rates(now_us, rates if rates is not None and told else present)

    def _control_attitude(self, now_us: int) -> None:
        topics = self._topics
        setpoint, reference = topics.vehicle_attitude_setpoint, self._reference
        local, q = topics.vehicle_local_position, topics.vehicle_attitude.q
        has_jumped = local.heading_reset_counter != self._heading_resets
        self._heading_resets = local.heading_reset_counter
        if has_jumped:
            self._manual.turned(local.delta_heading)
        if setpoint.timestamp > self._reference_us:
            since_s = (setpoint.timestamp - self._reference_us) * 1e-6 if self._reference_us else 0.0
            reference.follow(setpoint.q_d, setpoint.yaw_sp_move_rate, since_s)
            self._reference_us = setpoint.timestamp
        elif has_jumped:
            reference.turned(local.delta_heading)
        yaw_rate = setpoint.yaw_sp_move_rate if setpoint.yaw_sp_move_rate == setpoint.yaw_sp_move_rate else 0.0
        rates = rates_setpoint(
            q, reference.q, yaw_rate, self._attitude_gains, self._yaw_weight, self._rate_limits,
            reference.feed_forward(q),
        )  # fmt: skip
        shaken = self.autotune.rates
        if shaken is not None:
            rates = (rates[0] + shaken[0], rates[1] + shaken[1], rates[2] + shaken[2])
        self._set_rates(now_us, VehicleRatesSetpoint(now_us, rates, setpoint.thrust_body))

    def _set_rates(self, now_us: int, setpoint: VehicleRatesSetpoint) -> None:
        self._topics.vehicle_rates_setpoint = setpoint
        thrust = self._by_battery(setpoint.thrust_body) if self._scaled_by_battery else setpoint.thrust_body
        self._topics.vehicle_thrust_setpoint = VehicleThrustSetpoint(now_us, thrust)


def _has_horizontal(setpoint: TrajectorySetpoint) -> bool:
    """Whether a horizontal velocity is controlled."""
    (x, y, _), (vx, vy, _) = setpoint.position, setpoint.velocity
    return (x == x and y == y) or (vx == vx and vy == vy)


def known_rates(told: Vector3, present: Vector3) -> Vector3:
    """Rates as they are told, present ones where they are no number (MulticopterRateControl::Run)."""
    roll, pitch, yaw = told
    if math.isfinite(roll + pitch + yaw):
        return told
    roll, pitch, yaw = [rate if math.isfinite(rate) else now for rate, now in zip(told, present, strict=True)]
    return roll, pitch, yaw


def scaled(k: Vector3, gain: Vector3) -> Vector3:
    """Axis by axis product: MC_*RATE_K times a gain."""
    return k[0] * gain[0], k[1] * gain[1], k[2] * gain[2]


def tuple_radians(degrees: Vector3) -> Vector3:
    """Each in radians."""
    return math.radians(degrees[0]), math.radians(degrees[1]), math.radians(degrees[2])
