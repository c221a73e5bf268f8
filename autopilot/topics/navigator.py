"""Where to go, and what became of the plan (writer: navigator/; orbit_status: modes/)."""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN


class PositionSetpoint(NamedTuple):
    """One of the triplet. type is one of constants.SetpointType; NaN altitude keeps the present one."""

    timestamp: int = 0
    valid: bool = False
    type: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    yaw: float = NAN
    acceptance_radius: float = NAN
    cruising_speed: float = -1.0
    loiter_radius: float = NAN
    gliding_enabled: bool = False
    alt_acceptance_radius: float = NAN
    """NaN, and 0, for the parameter's."""
    loiter_direction_counter_clockwise: bool = False


class PositionSetpointTriplet(NamedTuple):
    """previous, current, next: what the AUTO modes fly."""

    timestamp: int = 0
    previous: PositionSetpoint = PositionSetpoint()
    current: PositionSetpoint = PositionSetpoint()
    next: PositionSetpoint = PositionSetpoint()


class VehicleRoi(NamedTuple):
    """Region of interest: mode 0 none, 1 the next waypoint turned by offsets (rad), 3 a location; timestamp 0 when
    nobody has ever set one. A mode without a place has zeros there, as in PX4."""

    mode: int = 0
    lat: float = 0.0
    lon: float = 0.0
    alt: float = 0.0
    roll_offset: float = 0.0
    pitch_offset: float = 0.0
    yaw_offset: float = 0.0
    timestamp: int = 0


class MissionResult(NamedTuple):
    """Progress of the mission, for MISSION_CURRENT and MISSION_ITEM_REACHED."""

    timestamp: int = 0
    mission_id: int = 0
    geofence_id: int = 0
    rally_id: int = 0
    valid: bool = False
    warning: bool = False
    finished: bool = False
    failure: bool = False
    seq_current: int = 0
    seq_reached: int = -1
    seq_reached_timestamp: int = 0
    seq_total: int = 0
    item_do_jump_changed: bool = False
    item_changed_index: int = 0
    mission_state: int = 0
    """MISSION_STATE of MISSION_CURRENT."""


class RtlTimeEstimate(NamedTuple):
    """How long a return from here would take, in seconds; the safe one with a factor and a margin. 0 when not valid."""

    timestamp: int = 0
    valid: bool = False
    time_estimate: float = 0.0
    safe_time_estimate: float = 0.0


class RtlStatus(NamedTuple):
    """What a return from here would be: rtl_type is RTL_STATUS_TYPE (1: straight to home or a rally point)."""

    timestamp: int = 0
    rtl_type: int = 0
    safe_point_index: int = 255
    """Of the rally point; 255: home."""
    safe_points_id: int = 0
    is_evaluation_pending: bool = False


class NavigatorStatus(NamedTuple):
    """Which mode the navigator runs, and whether it fails (1: it would go higher than the estimator allows)."""

    timestamp: int = 0
    nav_state: int = 0
    failure: int = 0


class PrecLandStatus(NamedTuple):
    """Writer: PrecLand, in each of its cycles."""

    timestamp: int = 0
    runs: bool = False
    """It has not landed yet (PREC_LAND_STATE_START to FALLBACK)."""


class NavigatorMissionItem(NamedTuple):
    """The item that is being flown, for the log and the vision_target_estimator: degrees, m, s, rad."""

    timestamp: int = 0
    sequence_current: int = 0
    nav_cmd: int = 0
    latitude: float = NAN
    longitude: float = NAN
    altitude: float = NAN
    time_inside: float = 0.0
    acceptance_radius: float = 0.0
    loiter_radius: float = 0.0
    yaw: float = NAN
    frame: int = 0
    origin: int = 0
    """0: of a plan, 1: made on board."""
    loiter_exit_xtrack: bool = False
    force_heading: bool = False
    altitude_is_relative: bool = False
    autocontinue: bool = True
    vtol_back_transition: bool = False


class DistanceSensorModeChangeRequest(NamedTuple):
    """A range finder that sleeps is to measure, for a landing."""

    timestamp: int = 0
    request_on_off: int = 0


class GeofenceResult(NamedTuple):
    """Breach of the fence, and what GF_ACTION asks for."""

    timestamp: int = 0
    max_dist_triggered: bool = False
    max_alt_triggered: bool = False
    custom_fence_triggered: bool = False
    action: int = 0
    breach_count: int = 0
    breach_time_us: int = 0

    @property
    def breached(self) -> bool:
        """Any of the limits is."""
        return self.max_dist_triggered or self.max_alt_triggered or self.custom_fence_triggered


class OrbitStatus(NamedTuple):
    """What the orbit mode flies (ORBIT_EXECUTION_STATUS); timestamp 0 when it was never flown."""

    timestamp: int = 0
    radius: float = NAN
    frame: int = 0
    """MAV_FRAME_GLOBAL, as FlightTaskOrbit.cpp has it, though degrees are sent as integers."""
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    yaw_behaviour: int = 0
