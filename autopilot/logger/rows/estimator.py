"""Where and how the vehicle is, and what the estimator tells of itself (topics/estimator.py, estimator_records.py)."""

import math

from autopilot.logger.packing import Pack, Value, by_name, row, zeros
from autopilot.topics import (
    EstimatorAidSource1d,
    EstimatorAidSource2d,
    EstimatorAidSource3d,
    EstimatorBias,
    EstimatorEventFlags,
    EstimatorFusionControl,
    EstimatorGpsStatus,
    EstimatorStates,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLandDetected,
    VehicleLocalPosition,
    WindEstimate,
    YawEstimatorStatus,
)

NAN = math.nan


@row("vehicle_attitude")
def vehicle_attitude(pack: Pack, record: VehicleAttitude) -> bytes:
    """Body to NED."""
    time_us = record.timestamp
    return pack(time_us, time_us, *record.q, 1.0, 0.0, 0.0, 0.0, 0)


@row("vehicle_angular_velocity")
def vehicle_angular_velocity(pack: Pack, record: VehicleAngularVelocity) -> bytes:
    """Body rates and their derivative."""
    time_us, xyz, derivative = record
    return pack(time_us, time_us, *xyz, *derivative)


def _global_origin(record: VehicleLocalPosition) -> tuple[Value, ...]:
    return record.ref_lat == record.ref_lat, record.ref_alt == record.ref_alt


vehicle_local_position = by_name(
    "vehicle_local_position",
    VehicleLocalPosition,
    {
        "timestamp_sample": "timestamp",
        "z_deriv": "vz",
        "unaided_heading": "heading",
        "heading_good_for_control": "xy_valid",
        **dict.fromkeys(("vxy_max", "vz_max", "hagl_min", "hagl_max_z", "hagl_max_xy"), NAN),
        **dict.fromkeys(("heading_var", "tilt_var", "dist_bottom_var"), NAN),
        **zeros(
            "delta_xy", "delta_vxy", "delta_z", "delta_vz", "delta_heading", "delta_dist_bottom", "vxy_reset_counter"
        ),
        **zeros(
            "vz_reset_counter", "heading_reset_counter", "dist_bottom_reset_counter", "dist_bottom_sensor_bitfield"
        ),
        **zeros("dead_reckoning"),
    },
    ("xy_global", "z_global"),
    _global_origin,
)
vehicle_global_position = by_name(
    "vehicle_global_position",
    VehicleGlobalPosition,
    {
        "timestamp_sample": "timestamp",
        "alt_ellipsoid": "alt",
        "lat_lon_valid": "valid",
        "alt_valid": "valid",
        **zeros("delta_alt", "delta_terrain", "lat_lon_reset_counter", "alt_reset_counter", "terrain_reset_counter"),
        **zeros("dead_reckoning"),
    },
    ("terrain_alt_valid",),
    lambda record: (record.terrain_alt == record.terrain_alt,),
)
vehicle_land_detected = by_name("vehicle_land_detected", VehicleLandDetected)
wind = by_name(
    "wind",
    WindEstimate,
    {
        "timestamp_sample": "timestamp",
        **dict.fromkeys(("variance_north", "variance_east", "tas_innov", "tas_innov_var"), NAN),
        **dict.fromkeys(("beta_innov", "beta_innov_var"), NAN),
    },
)
AID_SOURCES = {
    **dict.fromkeys(("baro_hgt", "fake_hgt", "gnss_hgt", "rng_hgt", "ev_hgt", "ev_yaw"), EstimatorAidSource1d),
    **dict.fromkeys(("fake_pos", "gnss_pos", "ev_pos", "optical_flow", "drag"), EstimatorAidSource2d),
    **dict.fromkeys(("gnss_vel", "mag", "gravity", "ev_vel"), EstimatorAidSource3d),
}
OWN_NAMES = {
    **{f"estimator_aid_src_{name}": by_name(f"estimator_aid_src_{name}", kind) for name, kind in AID_SOURCES.items()},
    **{
        topic: by_name(topic, kind)
        for topic, kind in {
            "estimator_baro_bias": EstimatorBias,
            "estimator_gnss_hgt_bias": EstimatorBias,
            "estimator_states": EstimatorStates,
            "estimator_event_flags": EstimatorEventFlags,
            "estimator_gps_status": EstimatorGpsStatus,
            "estimator_fusion_control": EstimatorFusionControl,
            "yaw_estimator_status": YawEstimatorStatus,
        }.items()
    },
}
"""Rows of those records whose fields are PX4's by name, all of them."""
