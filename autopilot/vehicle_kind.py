"""What kind of vehicle it is, and what follows from that: one row of traits for each kind.

PX4 v1.18 tells kinds apart by MAV_TYPE (Commander.cpp, commander_helper.cpp) and by what its start-up script starts for
the airframe (ROMFS/px4fmu_common/init.d, rc.*_apps). Whoever behaves differently for some vehicles asks a trait, never
the kind itself. A new kind is a row here, a control in `autopilot.py` and, in `parameters.json`, what it announces.
"""

from dataclasses import dataclass
from enum import Enum

from sitl_emu.autopilot.constants import NavState
from sitl_emu.core import dialect as mavlink

ROTARY_WING, ROVER = 1, 3
"""vehicle_status.vehicle_type (msg/versioned/VehicleStatus.msg)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Traits:
    """How a kind of vehicle differs from others."""

    # --- what it is, and what runs
    mav_types: frozenset[int]
    """Values of MAV_TYPE that mean this kind."""
    vehicle_type: int
    """vehicle_status.vehicle_type."""
    announces: str
    """Key of `parameters.json`: which parameters its modules look for."""
    modules: frozenset[str]
    """PX4's modules that run on some kinds alone (rc.mc_apps, rc.rover_ackermann_apps)."""
    land_detector: str
    """Which land detector is started, by the name that `land_detector status` says."""
    odid_ua_type: int
    """MAV_ODID_UA_TYPE (mavlink/open_drone_id_translations.cpp)."""

    # --- commander
    disarms_in_motion: bool
    """It may be disarmed wherever it is (Commander::disarm, is_ground_vehicle)."""
    arms_with_centred_throttle: bool
    """The stick has to be in its centre to arm; else low enough (Commander::arm)."""
    manual_controls_attitude: bool
    """MANUAL stabilizes (ModeUtil/control_mode.cpp, stabilization_required)."""
    sticks_take_over: bool
    """Sticks that move end an automatic mode (Commander::manualControlCheck)."""
    no_standard_modes: frozenset[NavState]
    """Modes that are standard modes on other kinds (lib/modes/standard_modes.hpp)."""

    # --- navigator
    flies: bool
    """It has a height to climb to and to descend from; what does not, goes along the ground."""
    ramps_up_at_takeoff: bool
    """It is in the air only once the takeoff ramp has ended (takeoff_status)."""
    stops_at_waypoints: bool
    """It holds at a waypoint that has a time, and turns to a heading there (navigator/mission_block.cpp)."""
    brakes_ahead: bool
    """Where it comes to rest is ahead of where it is (Navigator::preproject_stop_point)."""
    control_chooses_acceptance_radius: bool
    """Its control says how near to a corner it has to go (Navigator::get_acceptance_radius)."""
    speed_changes_at_once: bool
    """DO_CHANGE_SPEED changes the setpoint that is flown (navigator_main.cpp)."""
    takeoff_has_pitch: bool
    """NAV_TAKEOFF may set param1, which multicopters let pass for QGroundControl's sake (mavlink_receiver.cpp)."""


class VehicleKind(Enum):
    """The kinds of vehicle, each with its traits."""

    MULTICOPTER = Traits(
        mav_types=frozenset(
            {
                mavlink.MAV_TYPE_QUADROTOR,
                mavlink.MAV_TYPE_HEXAROTOR,
                mavlink.MAV_TYPE_OCTOROTOR,
                mavlink.MAV_TYPE_TRICOPTER,
                mavlink.MAV_TYPE_HELICOPTER,
                mavlink.MAV_TYPE_COAXIAL,
            }
        ),
        vehicle_type=ROTARY_WING,
        announces="multicopter",
        modules=frozenset(
            {
                "control_allocator",
                "flight_mode_manager",
                "mc_att_control",
                "mc_hover_thrust_estimator",
                "mc_pos_control",
                "mc_rate_control",
                "vision_target_estimator",
            }
        ),
        land_detector="multicopter",
        odid_ua_type=mavlink.MAV_ODID_UA_TYPE_HELICOPTER_OR_MULTIROTOR,
        disarms_in_motion=False,
        arms_with_centred_throttle=False,
        manual_controls_attitude=True,
        sticks_take_over=True,
        no_standard_modes=frozenset(),
        flies=True,
        ramps_up_at_takeoff=True,
        stops_at_waypoints=True,
        brakes_ahead=True,
        control_chooses_acceptance_radius=False,
        speed_changes_at_once=True,
        takeoff_has_pitch=True,
    )
    ROVER_ACKERMANN = Traits(
        mav_types=frozenset({mavlink.MAV_TYPE_GROUND_ROVER}),
        vehicle_type=ROVER,
        announces="rover",
        modules=frozenset({"rover_ackermann"}),
        land_detector="rover",
        odid_ua_type=mavlink.MAV_ODID_UA_TYPE_GROUND_OBSTACLE,
        disarms_in_motion=True,
        arms_with_centred_throttle=True,
        manual_controls_attitude=False,
        sticks_take_over=False,
        no_standard_modes=frozenset({NavState.ALTCTL, NavState.POSCTL, NavState.ORBIT}),
        flies=False,
        ramps_up_at_takeoff=False,
        stops_at_waypoints=False,
        brakes_ahead=False,
        control_chooses_acceptance_radius=True,
        speed_changes_at_once=False,
        takeoff_has_pitch=False,
    )

    traits: Traits

    def __init__(self, traits: Traits) -> None:
        self.traits = traits

    @classmethod
    def of_mav_type(cls, mav_type: float) -> "VehicleKind":
        """The kind that MAV_TYPE says; a multicopter where it is none that is emulated."""
        return next((kind for kind in cls if mav_type in kind.traits.mav_types), cls.MULTICOPTER)
