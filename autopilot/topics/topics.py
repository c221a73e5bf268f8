"""The slots of all topics, and what is done to them alone.

Modules of the tick read and write them at every turn: they are compiled (sitl_emu/compiled.py), which makes a slot a
place in memory instead of a name to look up.
"""

from typing import Final

from sitl_emu.autopilot.topics.commander import (
    ActuatorArmed,
    ConfigOverrides,
    FailsafeFlags,
    FailureDetectorStatus,
    FailureInjection,
    HealthReport,
    HomePosition,
    VehicleStatus,
)
from sitl_emu.autopilot.topics.commands import CommandRecord, CommandTold, VehicleCommandAck
from sitl_emu.autopilot.topics.control import (
    ActuatorControlsStatus,
    ActuatorOutputs,
    ActuatorSet,
    ActuatorTest,
    AutotuneAttitudeControlStatus,
    CollisionConstraints,
    ControlAllocatorStatus,
    HoverThrustEstimate,
    LandingGear,
    OffboardSetpoint,
    PositionControllerStatus,
    RateCtrlStatus,
    TakeoffStatus,
    TrajectorySetpoint,
    VehicleAttitudeSetpoint,
    VehicleConstraints,
    VehicleLocalPositionSetpoint,
    VehicleRatesSetpoint,
    VehicleThrustSetpoint,
    VehicleTorqueSetpoint,
)
from sitl_emu.autopilot.topics.estimator import (
    VehicleAngularVelocity,
    VehicleAttitude,
    VehicleGlobalPosition,
    VehicleLandDetected,
    VehicleLocalPosition,
    WindEstimate,
)
from sitl_emu.autopilot.topics.estimator_records import (
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
    OdometryVariances,
    YawEstimatorStatus,
)
from sitl_emu.autopilot.topics.manual_control import (
    ActionRequest,
    InputRc,
    ManualControlInput,
    ManualControlSetpoint,
    ManualControlSwitches,
    RcParameter,
)
from sitl_emu.autopilot.topics.navigator import (
    DistanceSensorModeChangeRequest,
    GeofenceResult,
    MissionResult,
    NavigatorMissionItem,
    NavigatorStatus,
    OrbitStatus,
    PositionSetpointTriplet,
    PrecLandStatus,
    RtlStatus,
    RtlTimeEstimate,
    VehicleRoi,
)
from sitl_emu.autopilot.topics.outside import (
    AuxGlobalPosition,
    DebugArray,
    DebugKeyValue,
    DebugValue,
    DebugVect,
    FiducialMarkerPosReport,
    FollowTarget,
    GcsHeartbeats,
    LandingTargetPose,
    ObstacleDistance,
    OnboardComputerStatus,
    RadioStatus,
    SensorOpticalFlow,
    TransponderReport,
    VehicleOdometry,
    VehicleOpticalFlow,
    VelocityLimits,
)
from sitl_emu.autopilot.topics.payload import (
    CameraCapture,
    CameraStatus,
    CameraTriggered,
    GimbalDeviceAttitudeStatus,
    GimbalDeviceInformation,
    GimbalDeviceSetAttitude,
    GimbalManagerInformation,
    GimbalManagerSetAttitude,
    GimbalManagerStatus,
    Gripper,
)
from sitl_emu.autopilot.topics.rover import (
    PurePursuitStatus,
    RoverAttitudeSetpoint,
    RoverAttitudeStatus,
    RoverPositionSetpoint,
    RoverRateSetpoint,
    RoverRateStatus,
    RoverSpeedSetpoint,
    RoverSpeedStatus,
    RoverSteeringSetpoint,
    RoverThrottleSetpoint,
)
from sitl_emu.autopilot.topics.sensors import (
    BatteryStatus,
    DistanceSensorSample,
    EscStatus,
    GroundTruth,
    RangingBeaconRange,
    SensorBaro,
    SensorCombined,
    SensorGps,
    SensorImu,
    SensorMag,
    SensorsStatusImu,
    SystemPower,
    VehicleAcceleration,
    VehicleAirData,
    VehicleImuStatus,
    VehicleMagnetometer,
)
from sitl_emu.autopilot.topics.system import (
    CpuLoad,
    LoggerStatus,
    ParameterUpdate,
    SensorSelection,
    TelemetryStatus,
    TimesyncStatus,
)

TRANSPONDER_REPORTS_KEPT: Final = 20
"""Length of transponder_report's queue."""


class Topics:
    """The present record of every topic; one slot each, each with one writer."""

    def __init__(self) -> None:
        self.sensor_imu = SensorImu()
        self.sensor_combined = SensorCombined()
        self.vehicle_acceleration = VehicleAcceleration()
        self.vehicle_air_data = VehicleAirData()
        self.vehicle_magnetometer = VehicleMagnetometer()
        self.sensor_baro = SensorBaro()
        self.sensor_mag = SensorMag()
        self.sensor_gps = SensorGps()
        self.distance_sensor = DistanceSensorSample()
        self.battery_status = BatteryStatus()
        self.groundtruth = GroundTruth()
        self.esc_status = EscStatus()
        self.sensors_status_imu = SensorsStatusImu()
        self.system_power = SystemPower()
        self.ranging_beacon = RangingBeaconRange()
        self.vehicle_imu_status = VehicleImuStatus()
        self.vehicle_attitude = VehicleAttitude()
        self.vehicle_angular_velocity = VehicleAngularVelocity()
        self.vehicle_local_position = VehicleLocalPosition()
        self.vehicle_global_position = VehicleGlobalPosition()
        self.estimator_status = EstimatorStatus()
        self.estimator_innovations = EstimatorInnovations()
        self.estimator_innovation_variances = EstimatorInnovations()
        self.estimator_innovation_test_ratios = EstimatorInnovations()
        self.estimator_aid_src_baro_hgt = EstimatorAidSource1d()
        self.estimator_aid_src_fake_hgt = EstimatorAidSource1d()
        self.estimator_aid_src_gnss_hgt = EstimatorAidSource1d()
        self.estimator_aid_src_rng_hgt = EstimatorAidSource1d()
        self.estimator_aid_src_ev_hgt = EstimatorAidSource1d()
        self.estimator_aid_src_ev_yaw = EstimatorAidSource1d()
        self.estimator_aid_src_fake_pos = EstimatorAidSource2d()
        self.estimator_aid_src_gnss_pos = EstimatorAidSource2d()
        self.estimator_aid_src_ev_pos = EstimatorAidSource2d()
        self.estimator_aid_src_optical_flow = EstimatorAidSource2d()
        self.estimator_aid_src_drag = EstimatorAidSource2d()
        self.estimator_aid_src_gnss_vel = EstimatorAidSource3d()
        self.estimator_aid_src_mag = EstimatorAidSource3d()
        self.estimator_aid_src_gravity = EstimatorAidSource3d()
        self.estimator_aid_src_ev_vel = EstimatorAidSource3d()
        self.estimator_baro_bias = EstimatorBias()
        self.estimator_gnss_hgt_bias = EstimatorBias()
        self.estimator_states = EstimatorStates()
        self.odometry_variances = OdometryVariances()
        self.estimator_status_flags = EstimatorStatusFlags()
        self.estimator_event_flags = EstimatorEventFlags()
        self.estimator_gps_status = EstimatorGpsStatus()
        self.estimator_fusion_control = EstimatorFusionControl()
        self.estimator_sensor_bias = EstimatorSensorBias()
        self.yaw_estimator_status = YawEstimatorStatus()
        self.ekf2_timestamps = Ekf2Timestamps()
        self.wind = WindEstimate()
        self.vehicle_land_detected = VehicleLandDetected()
        self.vehicle_status = VehicleStatus()
        self.health_report = HealthReport()
        self.failsafe_flags = FailsafeFlags()
        self.failure_detector_status = FailureDetectorStatus()
        self.home_position = HomePosition()
        self.actuator_armed = ActuatorArmed()
        self.config_overrides = ConfigOverrides()
        self.position_setpoint_triplet = PositionSetpointTriplet()
        self.vehicle_roi = VehicleRoi()
        self.camera_trigger = CameraTriggered()
        self.camera_capture = CameraCapture()
        self.camera_status = CameraStatus()
        self.gimbal_manager_set_attitude = GimbalManagerSetAttitude()
        self.gimbal_device_set_attitude = GimbalDeviceSetAttitude()
        self.gimbal_device_information = GimbalDeviceInformation()
        self.gimbal_device_attitude_status = GimbalDeviceAttitudeStatus()
        self.gimbal_manager_information = GimbalManagerInformation()
        self.gimbal_manager_status = GimbalManagerStatus()
        self.mission_result = MissionResult()
        self.geofence_result = GeofenceResult()
        self.rtl_time_estimate = RtlTimeEstimate()
        self.rtl_status = RtlStatus()
        self.navigator_status = NavigatorStatus()
        self.navigator_mission_item = NavigatorMissionItem()
        self.prec_land_status = PrecLandStatus()
        self.distance_sensor_mode_change_request = DistanceSensorModeChangeRequest()
        self.trajectory_setpoint = TrajectorySetpoint()
        self.position_controller_status = PositionControllerStatus()
        self.pure_pursuit_status = PurePursuitStatus()
        self.rover_position_setpoint = RoverPositionSetpoint()
        self.rover_speed_setpoint, self.rover_speed_status = RoverSpeedSetpoint(), RoverSpeedStatus()
        self.rover_attitude_setpoint, self.rover_attitude_status = RoverAttitudeSetpoint(), RoverAttitudeStatus()
        self.rover_rate_setpoint, self.rover_rate_status = RoverRateSetpoint(), RoverRateStatus()
        self.rover_steering_setpoint, self.rover_throttle_setpoint = RoverSteeringSetpoint(), RoverThrottleSetpoint()
        self.vehicle_constraints = VehicleConstraints()
        self.vehicle_local_position_setpoint = VehicleLocalPositionSetpoint()
        self.vehicle_attitude_setpoint = VehicleAttitudeSetpoint()
        self.vehicle_rates_setpoint = VehicleRatesSetpoint()
        self.vehicle_thrust_setpoint = VehicleThrustSetpoint()
        self.vehicle_torque_setpoint = VehicleTorqueSetpoint()
        self.rate_ctrl_status = RateCtrlStatus()
        self.actuator_controls_status = ActuatorControlsStatus()
        self.actuator_outputs = ActuatorOutputs()
        self.control_allocator_status = ControlAllocatorStatus()
        self.landing_gear = LandingGear()
        self.collision_constraints = CollisionConstraints()
        self.takeoff_status = TakeoffStatus()
        self.autotune_attitude_control_status = AutotuneAttitudeControlStatus()
        self.hover_thrust_estimate = HoverThrustEstimate()
        self.vehicle_visual_odometry = VehicleOdometry()
        self.vehicle_mocap_odometry = VehicleOdometry()
        """For the log alone: EKF2 does not look."""
        self.aux_global_position: tuple[AuxGlobalPosition, ...] = ()
        """The newest of each link of MAVLink, and of each source of DDS."""
        self.onboard_computer_status = OnboardComputerStatus()
        self.radio_status = RadioStatus()
        self.sensor_optical_flow = SensorOpticalFlow()
        self.vehicle_optical_flow = VehicleOpticalFlow()
        self.obstacle_distance = ObstacleDistance()
        self.obstacle_distance_fused = ObstacleDistance()
        """Writer: collision prevention; its map around the body."""
        self.distance_sensors_outside: tuple[DistanceSensorSample, ...] = ()
        """The newest of each link of MAVLink; DDS speaks as the first sensor that there is."""
        self.landing_target_pose = LandingTargetPose()
        self.fiducial_marker_pos_report = FiducialMarkerPosReport()
        self.follow_target = FollowTarget()
        self.velocity_limits = VelocityLimits()
        self.input_rc = InputRc()
        self.rc_parameter_map: tuple[RcParameter, ...] = (RcParameter(),) * 3
        """By knob, RC_MAP_PARAM1 to 3. Writer: mavlink/services/parameter.py."""
        self.manual_control_rc = ManualControlInput()
        self.manual_control_mavlink = ManualControlInput()
        self.manual_control_switches = ManualControlSwitches()
        self.action_requests: tuple[ActionRequest, ...] = ()
        self.manual_control_setpoint = ManualControlSetpoint()
        self.offboard_setpoint = OffboardSetpoint()
        self.gcs_heartbeats = GcsHeartbeats()
        self.transponder_reports: tuple[TransponderReport, ...] = ()
        """Writer: `queue_transponder_report`; the last few."""
        self.debug_key_value = DebugKeyValue()
        self.debug_value = DebugValue()
        self.debug_vect = DebugVect()
        self.debug_array = DebugArray()
        self.cpuload = CpuLoad()
        self.logger_status = LoggerStatus()
        self.parameter_update = ParameterUpdate()
        self.sensor_selection = SensorSelection()
        self.telemetry_status = self.telemetry_status_1 = TelemetryStatus()
        self.telemetry_status_2 = self.telemetry_status_3 = TelemetryStatus()
        """uORB's instances: of the links in their order, gcs to gimbal."""
        self.timesync_status = self.timesync_status_1 = self.timesync_status_2 = TimesyncStatus()
        """uORB's instances: of the links in the order in which they answered first."""
        self.orbit_status = OrbitStatus()
        self.actuator_test = ActuatorTest()
        self.actuator_set = ActuatorSet()
        self.gripper = Gripper()
        self.failure_injection = FailureInjection()
        self.vehicle_commands: tuple[CommandRecord, ...] = ()
        """Writer: commander; the last few accepted commands that navigator and flight modes act on."""
        self.navigator_commands: tuple[CommandRecord, ...] = ()
        """Writer: `commands.give_inside`; the last few commands of navigator and flight modes to other modules."""
        self.commands_told: tuple[CommandTold, ...] = ()
        """Writer: `commands.tell`; the last few commands and answers, for the log."""
        self.vehicle_command_acks: tuple[VehicleCommandAck, ...] = ()
        """Writers: owners of commands (`commands.answer_later`); mavlink/services/command.py sends and empties it."""


def topic_names(topics: Topics) -> list[str]:
    """Of all slots, sorted."""
    return [name for name in dir(topics) if not name.startswith("_")]


def queue_transponder_report(topics: Topics, report: TransponderReport) -> None:
    """Publish a report, numbered; the oldest gives way."""
    reports = topics.transponder_reports
    number = reports[-1].number + 1 if reports else 1
    topics.transponder_reports = (*reports[1 - TRANSPONDER_REPORTS_KEPT :], report._replace(number=number))
