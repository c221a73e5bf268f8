"""What the navigator's modes share: topics, parameters of the moment, the triplet in the making, progress, speed.

PX4's Navigator object as its NavigatorModes see it (src/modules/navigator/navigator.h, v1.18).
"""

import math
from typing import NamedTuple

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandResult, give_inside, tell
from sitl_emu.autopilot.constants import SetpointType, TakeoffState
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.topics import (
    PositionSetpoint,
    PositionSetpointTriplet,
    Topics,
    VehicleCommand,
    VehicleGlobalPosition,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.geodesy import MapProjection

BRAKING_DELAY_S = 0.6
"""Navigator::preproject_stop_point: 0.6 times MPC_JERK_AUTO over MPC_JERK_AUTO."""


class Settings(NamedTuple):
    """Parameters that navigation obeys, copied when they change."""

    nav_acc_rad_m: float
    nav_mc_alt_rad_m: float
    nav_loiter_rad_m: float
    nav_min_ltr_alt_m: float
    nav_min_gnd_dist_m: float
    nav_ltr_last_dl: bool
    nav_traff_avoid: int
    nav_traff_a_hor_m: float
    nav_traff_a_ver_m: float
    nav_traff_coll_t_s: float
    mis_takeoff_alt_m: float
    mis_yaw_err_rad: float
    wv_en: bool
    mis_yaw_tmt_s: float
    mis_mnt_yaw_ctl: int
    mis_command_tout_s: float
    mis_tko_land_req: int
    mis_dist_1wp_m: float
    rtl_return_alt_m: float
    rtl_descend_alt_m: float
    rtl_cone_ang_deg: float
    rtl_land_delay_s: float
    rtl_loiter_rad_m: float
    rtl_min_dist_m: float
    rtl_type: int
    rtl_pld_md: int
    rtl_time_factor: float
    rtl_time_margin_s: float
    mpc_xy_cruise_m_s: float
    ro_speed_lim_m_s: float
    mpc_z_v_auto_up_m_s: float
    mpc_z_v_auto_dn_m_s: float
    pld_btout_s: float
    pld_hacc_rad_m: float
    pld_fappr_alt_m: float
    pld_srch_alt_m: float
    pld_srch_tout_s: float
    pld_max_srch: int
    gf_action: int
    gf_source: int
    gf_max_hor_dist_m: float
    gf_max_ver_dist_m: float
    mpc_acc_hor_m_s2: float


def settings_of(parameters: Parameters) -> Settings:
    """Copy what navigation needs."""
    return Settings(
        nav_acc_rad_m=float(parameters["NAV_ACC_RAD"]),
        nav_mc_alt_rad_m=float(parameters["NAV_MC_ALT_RAD"]),
        nav_loiter_rad_m=abs(float(parameters["NAV_LOITER_RAD"])),
        nav_min_ltr_alt_m=float(parameters["NAV_MIN_LTR_ALT"]),
        nav_min_gnd_dist_m=float(parameters["NAV_MIN_GND_DIST"]),
        nav_ltr_last_dl=bool(parameters["NAV_LTR_LAST_DL"]),
        nav_traff_avoid=int(parameters["NAV_TRAFF_AVOID"]),
        nav_traff_a_hor_m=float(parameters["NAV_TRAFF_A_HOR"]),
        nav_traff_a_ver_m=float(parameters["NAV_TRAFF_A_VER"]),
        nav_traff_coll_t_s=float(parameters["NAV_TRAFF_COLL_T"]),
        mis_takeoff_alt_m=float(parameters["MIS_TAKEOFF_ALT"]),
        mis_yaw_err_rad=math.radians(parameters["MIS_YAW_ERR"]),
        wv_en=bool(parameters["WV_EN"]),
        mis_yaw_tmt_s=float(parameters["MIS_YAW_TMT"]),
        mis_mnt_yaw_ctl=int(parameters["MIS_MNT_YAW_CTL"]),
        mis_command_tout_s=float(parameters["MIS_COMMAND_TOUT"]),
        mis_tko_land_req=int(parameters["MIS_TKO_LAND_REQ"]),
        mis_dist_1wp_m=float(parameters["MIS_DIST_1WP"]),
        rtl_return_alt_m=float(parameters["RTL_RETURN_ALT"]),
        rtl_descend_alt_m=float(parameters["RTL_DESCEND_ALT"]),
        rtl_cone_ang_deg=float(parameters["RTL_CONE_ANG"]),
        rtl_land_delay_s=float(parameters["RTL_LAND_DELAY"]),
        rtl_loiter_rad_m=float(parameters["RTL_LOITER_RAD"]),
        rtl_min_dist_m=float(parameters["RTL_MIN_DIST"]),
        rtl_type=int(parameters["RTL_TYPE"]),
        rtl_pld_md=int(parameters["RTL_PLD_MD"]),
        rtl_time_factor=float(parameters["RTL_TIME_FACTOR"]),
        rtl_time_margin_s=float(parameters["RTL_TIME_MARGIN"]),
        mpc_xy_cruise_m_s=float(parameters["MPC_XY_CRUISE"]),
        ro_speed_lim_m_s=float(parameters["RO_SPEED_LIM"]),
        mpc_z_v_auto_up_m_s=float(parameters["MPC_Z_V_AUTO_UP"]),
        mpc_z_v_auto_dn_m_s=float(parameters["MPC_Z_V_AUTO_DN"]),
        pld_btout_s=float(parameters["PLD_BTOUT"]),
        pld_hacc_rad_m=float(parameters["PLD_HACC_RAD"]),
        pld_fappr_alt_m=float(parameters["PLD_FAPPR_ALT"]),
        pld_srch_alt_m=float(parameters["PLD_SRCH_ALT"]),
        pld_srch_tout_s=float(parameters["PLD_SRCH_TOUT"]),
        pld_max_srch=int(parameters["PLD_MAX_SRCH"]),
        gf_action=int(parameters["GF_ACTION"]),
        gf_source=int(parameters["GF_SOURCE"]),
        gf_max_hor_dist_m=float(parameters["GF_MAX_HOR_DIST"]),
        gf_max_ver_dist_m=float(parameters["GF_MAX_VER_DIST"]),
        mpc_acc_hor_m_s2=float(parameters["MPC_ACC_HOR"]),
    )


class NavigatorState:
    """The shared part; its owner is `Navigator`, which publishes what changed after each mode has run."""

    def __init__(
        self, topics: Topics, parameters: Parameters, dataman: Dataman, say: Say, outgoing: OutgoingCommands
    ) -> None:
        self.topics = topics
        self.parameters = parameters
        self.outgoing = outgoing
        self.system_id = int(parameters["MAV_SYS_ID"])
        self.dataman = dataman
        self.say = say
        self.settings = settings_of(parameters)
        self.traits = topics.vehicle_status.vehicle_kind.traits
        self.now_us = 0
        self.triplet = PositionSetpointTriplet()
        self.cruising_speed_m_s = -1.0
        """What DO_CHANGE_SPEED asked for; below 0: the vehicle's own."""
        self.finished = False
        """The mode has done its work."""
        self.mission_finished = False
        """As PX4's mission_result says it: a mission, TAKEOFF or LAND has ended, and none of them has begun since."""
        self.mission_seq = 0
        """The mission's current item as it was told last; another mode does not tell it when the ground chooses one."""
        self.seq_reached = self.told_reached = -1
        """The mission's item that was reached last, -1 for none, and as it was told: a mission that is left has none,
        which is told when another mode next tells of its own end or begin."""
        self.mission_failure = False
        """A heading that an item insists on was not reached in time."""
        self.return_alt_enforced = False
        """Whether a return goes to its height first, however high the vehicle is (RTL::set_return_alt_min)."""
        self.gimbal_asked_us: int | None = None
        """When it was asked that the gimbal be centred; None: nobody has."""

    # --- where the vehicle is --------------------------------------------------------------------------------

    @property
    def position(self) -> VehicleGlobalPosition:
        """Latitude, longitude, altitude."""
        return self.topics.vehicle_global_position

    @property
    def landed(self) -> bool:
        """The land detector says so."""
        return self.topics.vehicle_land_detected.landed

    @property
    def takeoff_type(self) -> SetpointType:
        """What a takeoff is: who flies already just goes there (MissionBlock::mission_item_to_position_setpoint)."""
        topics = self.topics
        flies = self.armed and not self.landed and not topics.vehicle_land_detected.maybe_landed
        if self.traits.ramps_up_at_takeoff:
            flies = flies and topics.takeoff_status.state == TakeoffState.FLIGHT
        return SetpointType.POSITION if flies else SetpointType.TAKEOFF

    @property
    def armed(self) -> bool:
        """Motors may turn."""
        return self.topics.vehicle_status.armed

    def acceptance_radius_m(self) -> float:
        """How near a place counts as reached: NAV_ACC_RAD, or what the control needs for its corner."""
        radius_m = self.settings.nav_acc_rad_m
        if not self.traits.control_chooses_acceptance_radius:
            return radius_m
        return max(radius_m, self.topics.position_controller_status.acceptance_radius)

    def altitude_acceptance_m(self) -> float:
        """How near a height counts as reached: the setpoint's own, else NAV_MC_ALT_RAD; any for what does not fly."""
        if not self.traits.flies:
            return math.inf
        radius_m = self.triplet.current.alt_acceptance_radius
        return radius_m if math.isfinite(radius_m) and radius_m > 0.0 else self.settings.nav_mc_alt_rad_m

    def home_alt_m(self) -> float:
        """AMSL altitude that relative altitudes count from; the reference's where home is unknown."""
        home = self.topics.home_position
        return home.alt if home.valid else self.topics.vehicle_local_position.ref_alt

    def loiter_alt_m(self) -> float:
        """AMSL height to hold at: the present one, but not lower than NAV_MIN_LTR_ALT, in whole metres, above home."""
        alt_m, least_m = self.position.alt, self.settings.nav_min_ltr_alt_m
        has_least = math.isfinite(least_m) and least_m >= 1.0
        return max(alt_m, self.home_alt_m() + math.floor(least_m)) if has_least else alt_m

    def stop_point(self) -> tuple[float, float]:
        """(lat_deg, lon_deg) where the vehicle comes to rest when it brakes now (PX4's preproject_stop_point)."""
        local, position = self.topics.vehicle_local_position, self.position
        speed = math.hypot(local.vx, local.vy)
        moves = self.traits.brakes_ahead and speed > 0.0
        if not moves or self.settings.mpc_acc_hor_m_s2 <= 0.0:
            return position.lat, position.lon
        settings = self.settings
        distance = speed * (speed / (2.0 * settings.mpc_acc_hor_m_s2) + BRAKING_DELAY_S)
        place = MapProjection(position.lat, position.lon)
        return place.reproject(local.vx / speed * distance, local.vy / speed * distance)

    # --- what it shall do ------------------------------------------------------------------------------------

    def setpoint(
        self,
        kind: SetpointType,
        lat_deg: float,
        lon_deg: float,
        alt_m: float,
        yaw_rad: float = math.nan,
        acceptance_radius_m: float = math.nan,
    ) -> PositionSetpoint:
        """A setpoint of this moment, at the present cruising speed."""
        radius = acceptance_radius_m if acceptance_radius_m == acceptance_radius_m else self.settings.nav_acc_rad_m
        return PositionSetpoint(
            self.now_us,
            True,
            int(kind),
            lat_deg,
            lon_deg,
            alt_m,
            yaw_rad,
            radius,
            self.cruising_speed_m_s,
            self.settings.nav_loiter_rad_m,
            False,
        )

    def fly(
        self,
        current: PositionSetpoint,
        *,
        previous: PositionSetpoint | None = None,
        following: PositionSetpoint | None = None,
    ) -> None:
        """Replace the triplet."""
        self.triplet = PositionSetpointTriplet(
            self.now_us, previous or self.no_setpoint(), current, following or self.no_setpoint()
        )

    def fly_at_cruising_speed(self) -> None:
        """The leg that is flown gets the cruising speed of now, where the vehicle can change it on its way."""
        if self.traits.speed_changes_at_once:
            triplet = self.triplet
            current = triplet.current._replace(timestamp=self.now_us, cruising_speed=self.cruising_speed_m_s)
            self.fly(current, previous=triplet.previous, following=triplet.next)

    def no_setpoint(self) -> PositionSetpoint:
        """What PX4's navigator resets a setpoint to (reset_position_setpoint); it is not valid."""
        settings = self.settings
        return PositionSetpoint(
            self.now_us,
            False,
            int(SetpointType.IDLE),
            alt=0.0,
            acceptance_radius=settings.nav_acc_rad_m,
            cruising_speed=self.cruising_speed_m_s,
            loiter_radius=settings.nav_loiter_rad_m,
            alt_acceptance_radius=0.0,
        )

    def reset_triplet(self) -> None:
        """Fly nothing (Navigator::reset_triplets)."""
        self.fly(self.no_setpoint())

    def tell_mission(self) -> None:
        """What the ground knows of the mission becomes what is known here (set_mission_result_updated)."""
        self.dataman.told_seq, self.told_reached = self.mission_seq, self.seq_reached

    def command(self, command: VehicleCommand, component: int = 0) -> None:
        """Give a command to the autopilot's other modules, and to `component` on every link (0: to all of them)."""
        give_inside(self.topics, self.now_us, command)
        self.tell(command, component)

    def tell(self, command: VehicleCommand, component: int = 0) -> None:
        """Send a command on every link that the navigator itself obeys: PX4 publishes these too."""
        self.outgoing.give(
            command._replace(target_system=self.system_id, target_component=component, from_external=False)
        )

    def tell_obeyed(self, command: VehicleCommand) -> None:
        """The same of what the navigator has obeyed; the log gets its answer, too (publish_vehicle_command_ack)."""
        self.tell(command)
        own = command._replace(source_system=self.system_id, source_component=mavlink.MAV_COMP_ID_AUTOPILOT1)
        tell(self.topics, self.now_us, own, CommandResult(mavlink.MAV_RESULT_ACCEPTED))

    def centre_gimbal(self) -> None:
        """Turn the gimbal forward in a moment; asked again before that, it is done once."""
        if self.gimbal_asked_us is None:
            self.gimbal_asked_us = self.now_us
