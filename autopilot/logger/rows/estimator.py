"""Where and how the vehicle is, and what the estimator tells of itself (topics/estimator.py, estimator_records.py)."""

import math

from sitl_emu.autopilot.logger.packing import Pack, by_name, row
from sitl_emu.autopilot.topics import (
    NOT_NEW,
    Ekf2Timestamps,
    EstimatorAidSource1d,
    EstimatorAidSource2d,
    EstimatorAidSource3d,
    EstimatorBias,
    EstimatorEventFlags,
    EstimatorFusionControl,
    EstimatorGpsStatus,
    EstimatorInnovations,
    EstimatorSensorBias,
    EstimatorStates,
    EstimatorStatus,
    EstimatorStatusFlags,
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLandDetected,
    VehicleLocalPosition,
    WindEstimate,
    YawEstimatorStatus,
)

NAN = math.nan


@row("vehicle_angular_velocity")
def vehicle_angular_velocity(pack: Pack, record: VehicleAngularVelocity) -> bytes:
    """Body rates and their derivative."""
    time_us, xyz, derivative = record
    return pack(time_us, time_us, *xyz, *derivative)


@row("ekf2_timestamps")
def ekf2_timestamps(pack: Pack, record: Ekf2Timestamps) -> bytes:
    """What was new with an IMU sample; no vehicle of ours has an airspeed sensor."""
    time_us, *others = record
    return pack(time_us, NOT_NEW, NOT_NEW, *others)


vehicle_attitude = by_name("vehicle_attitude", VehicleAttitude, {"timestamp_sample": "timestamp"})
vehicle_local_position = by_name("vehicle_local_position", VehicleLocalPosition)
vehicle_global_position = by_name("vehicle_global_position", VehicleGlobalPosition)
vehicle_land_detected = by_name("vehicle_land_detected", VehicleLandDetected)
wind = by_name(
    "wind",
    WindEstimate,
    {
        "timestamp_sample": "timestamp",
        **dict.fromkeys(("tas_innov", "tas_innov_var", "beta_innov", "beta_innov_var"), NAN),
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
            "estimator_status": EstimatorStatus,
            "estimator_status_flags": EstimatorStatusFlags,
            "estimator_sensor_bias": EstimatorSensorBias,
            "estimator_innovations": EstimatorInnovations,
            "estimator_innovation_variances": EstimatorInnovations,
            "estimator_innovation_test_ratios": EstimatorInnovations,
        }.items()
    },
}
"""Rows of those records whose fields are PX4's by name, all of them."""
