"""What the estimator tells of itself: fusions, biases, flags (writer: estimator/). PX4 logs all of it.

Fields are those of PX4's messages of the same names (msg/, v1.18), in their order.
"""

from typing import Final, NamedTuple

from sitl_emu.autopilot.topics.values import NAN, NAN3, Vector3


class EstimatorAidSource1d(NamedTuple):
    """The last sample of a sensor of one number, and what became of it. A test ratio of more than 1 is refused."""

    timestamp: int = 0
    timestamp_sample: int = 0
    estimator_instance: int = 0
    device_id: int = 0
    time_last_fuse: int = 0
    observation: float = NAN
    observation_variance: float = NAN
    innovation: float = NAN
    innovation_filtered: float = NAN
    innovation_variance: float = NAN
    test_ratio: float = NAN
    test_ratio_filtered: float = NAN
    innovation_rejected: bool = False
    fused: bool = False


class EstimatorAidSource2d(NamedTuple):
    """The same of two axes."""

    timestamp: int = 0
    timestamp_sample: int = 0
    estimator_instance: int = 0
    device_id: int = 0
    time_last_fuse: int = 0
    observation: tuple[float, float] = (NAN, NAN)
    observation_variance: tuple[float, float] = (NAN, NAN)
    innovation: tuple[float, float] = (NAN, NAN)
    innovation_filtered: tuple[float, float] = (NAN, NAN)
    innovation_variance: tuple[float, float] = (NAN, NAN)
    test_ratio: tuple[float, float] = (NAN, NAN)
    test_ratio_filtered: tuple[float, float] = (NAN, NAN)
    innovation_rejected: bool = False
    fused: bool = False


class EstimatorAidSource3d(NamedTuple):
    """The same of three axes."""

    timestamp: int = 0
    timestamp_sample: int = 0
    estimator_instance: int = 0
    device_id: int = 0
    time_last_fuse: int = 0
    observation: Vector3 = NAN3
    observation_variance: Vector3 = NAN3
    innovation: Vector3 = NAN3
    innovation_filtered: Vector3 = NAN3
    innovation_variance: Vector3 = NAN3
    test_ratio: Vector3 = NAN3
    test_ratio_filtered: Vector3 = NAN3
    innovation_rejected: bool = False
    fused: bool = False


class EstimatorBias(NamedTuple):
    """Offset between a height sensor and the filter's height."""

    timestamp: int = 0
    timestamp_sample: int = 0
    device_id: int = 0
    bias: float = NAN
    bias_var: float = NAN
    innov: float = NAN
    innov_var: float = NAN
    innov_test_ratio: float = NAN


class EstimatorInnovations(NamedTuple):
    """Innovations of all sensors, estimate minus measurement; the same record holds their variances or test ratios."""

    timestamp: int = 0
    timestamp_sample: int = 0
    gps_hvel: tuple[float, float] = (NAN, NAN)
    gps_vvel: float = NAN
    gps_hpos: tuple[float, float] = (NAN, NAN)
    gps_vpos: float = NAN
    ev_hvel: tuple[float, float] = (NAN, NAN)
    ev_vvel: float = NAN
    ev_hpos: tuple[float, float] = (NAN, NAN)
    ev_vpos: float = NAN
    rng_vpos: float = NAN
    baro_vpos: float = NAN
    aux_hvel: tuple[float, float] = (NAN, NAN)
    flow: tuple[float, float] = (NAN, NAN)
    heading: float = NAN
    mag_field: Vector3 = NAN3
    gravity: Vector3 = NAN3
    drag: tuple[float, float] = (NAN, NAN)
    airspeed: float = NAN
    beta: float = NAN
    hagl: float = NAN
    hagl_rate: float = NAN


class EstimatorStates(NamedTuple):
    """The filter's state at the fusion horizon, and the diagonal of its covariance."""

    timestamp: int = 0
    timestamp_sample: int = 0
    states: tuple[float, ...] = (NAN,) * 25
    n_states: int = 0
    covariances: tuple[float, ...] = (NAN,) * 24


class OdometryVariances(NamedTuple):
    """Of vehicle_odometry, as of 40 ms ago at most: the filter's own."""

    timestamp: int = 0
    attitude: Vector3 = NAN3
    """About north, east and down."""
    velocity: Vector3 = NAN3
    position: Vector3 = NAN3


NOT_NEW: Final = 32767
"""Ekf2Timestamps.msg's RELATIVE_TIMESTAMP_INVALID."""


class Ekf2Timestamps(NamedTuple):
    """uORB ekf2_timestamps: what was new with an IMU sample, and when it was published, from that sample on in 0.1 ms.

    Writer: estimator.py, while a log takes it.
    """

    timestamp: int = 0
    """Of the IMU sample."""
    distance_sensor_timestamp_rel: int = NOT_NEW
    optical_flow_timestamp_rel: int = NOT_NEW
    vehicle_air_data_timestamp_rel: int = NOT_NEW
    vehicle_magnetometer_timestamp_rel: int = NOT_NEW
    visual_odometry_timestamp_rel: int = NOT_NEW


class EstimatorStatus(NamedTuple):
    """Health of the filter. Its test ratios are roots of filtered ones: 1 is the gate, NaN that nothing aids."""

    timestamp: int = 0
    timestamp_sample: int = 0
    output_tracking_error: Vector3 = NAN3
    gps_check_fail_flags: int = 0
    control_mode_flags: int = 0
    filter_fault_flags: int = 0
    pos_horiz_accuracy: float = NAN
    pos_vert_accuracy: float = NAN
    hdg_test_ratio: float = NAN
    vel_test_ratio: float = NAN
    pos_test_ratio: float = NAN
    hgt_test_ratio: float = NAN
    tas_test_ratio: float = NAN
    hagl_test_ratio: float = NAN
    beta_test_ratio: float = NAN
    solution_status_flags: int = 0
    reset_count_vel_ne: int = 0
    reset_count_vel_d: int = 0
    reset_count_pos_ne: int = 0
    reset_count_pod_d: int = 0
    reset_count_quat: int = 0
    time_slip: float = NAN
    pre_flt_fail_innov_heading: bool = False
    pre_flt_fail_innov_height: bool = False
    pre_flt_fail_innov_pos_horiz: bool = False
    pre_flt_fail_innov_vel_horiz: bool = False
    pre_flt_fail_innov_vel_vert: bool = False
    pre_flt_fail_mag_field_disturbed: bool = False
    accel_device_id: int = 0
    gyro_device_id: int = 0
    baro_device_id: int = 0
    mag_device_id: int = 0
    health_flags: int = 0
    timeout_flags: int = 0
    mag_inclination_deg: float = NAN
    mag_inclination_ref_deg: float = NAN
    mag_strength_gs: float = NAN
    mag_strength_ref_gs: float = NAN


class EstimatorStatusFlags(NamedTuple):
    """What the filter does (cs_) and what is wrong (fs_)."""

    timestamp: int = 0
    timestamp_sample: int = 0
    control_status_changes: int = 0
    cs_tilt_align: bool = False
    cs_yaw_align: bool = False
    cs_gnss_pos: bool = False
    cs_opt_flow: bool = False
    cs_mag_hdg: bool = False
    cs_mag_3d: bool = False
    cs_mag_dec: bool = False
    cs_in_air: bool = False
    cs_wind: bool = False
    cs_baro_hgt: bool = False
    cs_rng_hgt: bool = False
    cs_gps_hgt: bool = False
    cs_ev_pos: bool = False
    cs_ev_yaw: bool = False
    cs_ev_hgt: bool = False
    cs_fuse_beta: bool = False
    cs_mag_field_disturbed: bool = False
    cs_fixed_wing: bool = False
    cs_mag_fault: bool = False
    cs_fuse_aspd: bool = False
    cs_gnd_effect: bool = False
    cs_rng_stuck: bool = False
    cs_gnss_yaw: bool = False
    cs_mag_aligned_in_flight: bool = False
    cs_ev_vel: bool = False
    cs_synthetic_mag_z: bool = False
    cs_vehicle_at_rest: bool = False
    cs_gnss_yaw_fault: bool = False
    cs_rng_fault: bool = False
    cs_inertial_dead_reckoning: bool = False
    cs_wind_dead_reckoning: bool = False
    cs_rng_kin_consistent: bool = False
    cs_fake_pos: bool = False
    cs_fake_hgt: bool = False
    cs_gravity_vector: bool = False
    cs_mag: bool = False
    cs_ev_yaw_fault: bool = False
    cs_mag_heading_consistent: bool = False
    cs_aux_gpos: bool = False
    cs_rng_terrain: bool = False
    cs_opt_flow_terrain: bool = False
    cs_valid_fake_pos: bool = False
    cs_constant_pos: bool = False
    cs_baro_fault: bool = False
    cs_gnss_vel: bool = False
    cs_gnss_fault: bool = False
    cs_yaw_manual: bool = False
    cs_gnss_hgt_fault: bool = False
    cs_in_transition: bool = False
    cs_heading_observable: bool = False
    fault_status_changes: int = 0
    fs_bad_mag_x: bool = False
    fs_bad_mag_y: bool = False
    fs_bad_mag_z: bool = False
    fs_bad_hdg: bool = False
    fs_bad_mag_decl: bool = False
    fs_bad_airspeed: bool = False
    fs_bad_sideslip: bool = False
    fs_bad_optflow_x: bool = False
    fs_bad_optflow_y: bool = False
    fs_bad_acc_vertical: bool = False
    fs_bad_acc_clipping: bool = False


class EstimatorEventFlags(NamedTuple):
    """What the filter did just now."""

    timestamp: int = 0
    timestamp_sample: int = 0
    information_event_changes: int = 0
    gps_checks_passed: bool = False
    reset_vel_to_gps: bool = False
    reset_vel_to_flow: bool = False
    reset_vel_to_vision: bool = False
    reset_vel_to_zero: bool = False
    reset_pos_to_last_known: bool = False
    reset_pos_to_gps: bool = False
    reset_pos_to_vision: bool = False
    starting_gps_fusion: bool = False
    starting_vision_pos_fusion: bool = False
    starting_vision_vel_fusion: bool = False
    starting_vision_yaw_fusion: bool = False
    yaw_aligned_to_imu_gps: bool = False
    reset_hgt_to_baro: bool = False
    reset_hgt_to_gps: bool = False
    reset_hgt_to_rng: bool = False
    reset_hgt_to_ev: bool = False


class EstimatorGpsStatus(NamedTuple):
    """The checks of the GNSS receiver."""

    timestamp: int = 0
    timestamp_sample: int = 0
    checks_passed: bool = False
    check_fail_gps_fix: bool = False
    check_fail_min_sat_count: bool = False
    check_fail_max_pdop: bool = False
    check_fail_max_horz_err: bool = False
    check_fail_max_vert_err: bool = False
    check_fail_max_spd_err: bool = False
    check_fail_max_horz_drift: bool = False
    check_fail_max_vert_drift: bool = False
    check_fail_max_horz_spd_err: bool = False
    check_fail_max_vert_spd_err: bool = False
    check_fail_spoofed_gps: bool = False
    position_drift_rate_horizontal_m_s: float = NAN
    position_drift_rate_vertical_m_s: float = NAN
    filtered_horizontal_speed_m_s: float = NAN


class EstimatorFusionControl(NamedTuple):
    """Which sensors are to be fused, and which are."""

    timestamp: int = 0
    gps_intended: tuple[bool, ...] = (False,) * 2
    of_intended: bool = False
    ev_intended: bool = False
    agp_intended: tuple[bool, ...] = (False,) * 4
    baro_intended: bool = False
    rng_intended: bool = False
    mag_intended: bool = False
    aspd_intended: bool = False
    rngbcn_intended: bool = False
    gps_active: tuple[bool, ...] = (False,) * 2
    of_active: bool = False
    ev_active: bool = False
    agp_active: tuple[bool, ...] = (False,) * 4
    baro_active: bool = False
    rng_active: bool = False
    mag_active: bool = False
    aspd_active: bool = False
    rngbcn_active: bool = False


class EstimatorSensorBias(NamedTuple):
    """Biases that the filter has learnt."""

    timestamp: int = 0
    timestamp_sample: int = 0
    gyro_device_id: int = 0
    gyro_bias: Vector3 = NAN3
    gyro_bias_limit: float = NAN
    gyro_bias_variance: Vector3 = NAN3
    gyro_bias_valid: bool = False
    gyro_bias_stable: bool = False
    accel_device_id: int = 0
    accel_bias: Vector3 = NAN3
    accel_bias_limit: float = NAN
    accel_bias_variance: Vector3 = NAN3
    accel_bias_valid: bool = False
    accel_bias_stable: bool = False
    mag_device_id: int = 0
    mag_bias: Vector3 = NAN3
    mag_bias_limit: float = NAN
    mag_bias_variance: Vector3 = NAN3
    mag_bias_valid: bool = False
    mag_bias_stable: bool = False


class YawEstimatorStatus(NamedTuple):
    """The emergency yaw estimate from GNSS velocity and IMU alone."""

    timestamp: int = 0
    timestamp_sample: int = 0
    yaw_composite: float = NAN
    yaw_variance: float = NAN
    yaw_composite_valid: bool = False
    yaw: tuple[float, ...] = (NAN,) * 5
    innov_vn: tuple[float, ...] = (NAN,) * 5
    innov_ve: tuple[float, ...] = (NAN,) * 5
    weight: tuple[float, ...] = (NAN,) * 5
