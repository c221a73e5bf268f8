"""What the filter does and what is wrong with it: bits and names of PX4's filter_control_status and fault_status.

PX4's EKF2 (EKF/common.h, v1.18). Sensors that no vehicle of ours has (airspeed, beacons, GNSS heading, auxiliary
positions) keep their bits, which never are set.
"""

from dataclasses import dataclass, fields
from operator import attrgetter


@dataclass(slots=True)
class ControlStatus:
    """In the order of the bits."""

    tilt_align: bool = False
    yaw_align: bool = False
    gnss_pos: bool = False
    opt_flow: bool = False
    mag_hdg: bool = False
    mag_3d: bool = False
    mag_dec: bool = False
    in_air: bool = True
    wind: bool = False
    baro_hgt: bool = False
    rng_hgt: bool = False
    gps_hgt: bool = False
    ev_pos: bool = False
    ev_yaw: bool = False
    ev_hgt: bool = False
    fuse_beta: bool = False
    mag_field_disturbed: bool = False
    fixed_wing: bool = False
    mag_fault: bool = False
    fuse_aspd: bool = False
    gnd_effect: bool = False
    rng_stuck: bool = False
    gnss_yaw: bool = False
    mag_aligned_in_flight: bool = False
    ev_vel: bool = False
    synthetic_mag_z: bool = False
    vehicle_at_rest: bool = False
    gnss_yaw_fault: bool = False
    rng_fault: bool = False
    inertial_dead_reckoning: bool = False
    wind_dead_reckoning: bool = False
    rng_kin_consistent: bool = False
    fake_pos: bool = False
    fake_hgt: bool = False
    gravity_vector: bool = False
    mag: bool = False
    ev_yaw_fault: bool = False
    mag_heading_consistent: bool = False
    aux_gpos: bool = False
    rng_terrain: bool = False
    opt_flow_terrain: bool = False
    valid_fake_pos: bool = False
    constant_pos: bool = False
    baro_fault: bool = False
    gnss_vel: bool = False
    gnss_fault: bool = False
    yaw_manual: bool = False
    gnss_hgt_fault: bool = False
    in_transition: bool = False
    heading_observable: bool = False
    rngbcn_fusion: bool = False

    # What aids the filter (EKF/ekf_helper.cpp, height_control.cpp)

    def horizontal_position_aids(self) -> int:
        """How many sources of horizontal position are in use."""
        return self.gnss_pos + self.ev_pos + self.aux_gpos

    def horizontal_velocity_aids(self) -> int:
        """How many sources of horizontal velocity are in use."""
        return self.gnss_vel + self.opt_flow + self.ev_vel

    @property
    def horizontal_aiding(self) -> bool:
        """Something aids horizontally."""
        vision = self.ev_pos or self.ev_vel
        return self.gnss_vel or self.gnss_pos or self.opt_flow or vision or self.aux_gpos

    def other_horizontal_aid(self, flag: bool) -> bool:
        """Something aids horizontally besides the source that this flag stands for."""
        return self.horizontal_position_aids() + self.horizontal_velocity_aids() > int(flag)

    def vertical_position_aids(self) -> int:
        """How many sources of height are in use."""
        return self.gps_hgt + self.baro_hgt + self.rng_hgt + self.ev_hgt

    @property
    def vertical_velocity_aiding(self) -> bool:
        """Something measures the vertical velocity."""
        return self.gnss_vel or self.ev_vel

    @property
    def vertical_aiding(self) -> bool:
        """Something measures height or vertical velocity."""
        return self.vertical_position_aids() > 0 or self.vertical_velocity_aiding


@dataclass(slots=True)
class FaultStatus:
    """In the order of the bits."""

    bad_mag_x: bool = False
    bad_mag_y: bool = False
    bad_mag_z: bool = False
    bad_hdg: bool = False
    bad_mag_decl: bool = False
    bad_airspeed: bool = False
    bad_sideslip: bool = False
    bad_optflow_x: bool = False
    bad_optflow_y: bool = False
    unused: bool = False
    bad_acc_vertical: bool = False
    bad_acc_clipping: bool = False


CONTROL_NAMES, FAULT_NAMES = (tuple(field.name for field in fields(kind)) for kind in (ControlStatus, FaultStatus))
_control, _faults = attrgetter(*CONTROL_NAMES), attrgetter(*FAULT_NAMES)


def control_flags(flags: ControlStatus) -> tuple[bool, ...]:
    """All flags, in the order of the bits."""
    values: tuple[bool, ...] = _control(flags)
    return values


def fault_flags(faults: FaultStatus) -> tuple[bool, ...]:
    """All faults, in the order of the bits."""
    values: tuple[bool, ...] = _faults(faults)
    return values


def mask(flags: tuple[bool, ...]) -> int:
    """The flags as one number, the first is bit 0."""
    return int("".join("1" if flag else "0" for flag in reversed(flags)), 2)
