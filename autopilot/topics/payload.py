"""What is carried: gripper, camera, gimbal (writers: payload/, mavlink/)."""

from typing import NamedTuple

from sitl_emu.autopilot.topics.values import NAN, NAN3, Quaternion, Vector3


class Gripper(NamedTuple):
    """Writer: payload_deliverer. Closed 1, open -1, as the output of function 430 carries it."""

    position: float = -1.0


class CameraTriggered(NamedTuple):
    """uORB camera_trigger: an image was asked of the camera; timestamp 0 when none ever was."""

    timestamp: int = 0
    seq: int = 0


class CameraStatus(NamedTuple):
    """The camera whose HEARTBEAT was heard last; 0 when none ever was. Writer: mavlink/services/heartbeat.py."""

    timestamp: int = 0
    active_sys_id: int = 0
    active_comp_id: int = 0


class CameraCapture(NamedTuple):
    """uORB camera_capture: where the vehicle was; ground_distance is the height above the terrain, -1 not known."""

    timestamp: int = 0
    seq: int = 0
    lat: float = NAN
    lon: float = NAN
    alt: float = NAN
    ground_distance: float = -1.0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class GimbalManagerSetAttitude(NamedTuple):
    """Last GIMBAL_MANAGER_SET_ATTITUDE or _SET_MANUAL_CONTROL; manual rates are -1..1."""

    timestamp: int = 0
    origin_sysid: int = 0
    origin_compid: int = 0
    flags: int = 0
    q: Quaternion = (NAN, NAN, NAN, NAN)
    angular_velocity: Vector3 = NAN3
    manual: bool = False


class GimbalDeviceSetAttitude(NamedTuple):
    """Writer: gimbal manager; NaN where nothing is wanted."""

    timestamp: int = 0
    target_component: int = 0
    flags: int = 0
    q: Quaternion = (NAN, NAN, NAN, NAN)
    angular_velocity: Vector3 = NAN3


class GimbalDeviceInformation(NamedTuple):
    """What a gimbal device said of itself; angles in rad. timestamp 0: none was heard.

    PX4 does not take the stops of the roll (handle_message_gimbal_device_information).
    """

    timestamp: int = 0
    gimbal_device_id: int = 0
    vendor_name: str = ""
    model_name: str = ""
    custom_name: str = ""
    firmware_version: int = 0
    hardware_version: int = 0
    uid: int = 0
    cap_flags: int = 0
    pitch_min: float = NAN
    pitch_max: float = NAN
    yaw_min: float = NAN
    yaw_max: float = NAN


class GimbalManagerInformation(NamedTuple):
    """Writer: gimbal manager, when it finds a device."""

    timestamp: int = 0
    cap_flags: int = 0
    pitch_min: float = NAN
    pitch_max: float = NAN
    yaw_min: float = NAN
    yaw_max: float = NAN
    gimbal_device_id: int = 0


class GimbalDeviceAttitudeStatus(NamedTuple):
    """What a gimbal device last said of its attitude."""

    timestamp: int = 0
    device_flags: int = 0
    q: Quaternion = (1.0, 0.0, 0.0, 0.0)


class GimbalManagerStatus(NamedTuple):
    """Writer: gimbal manager."""

    timestamp: int = 0
    flags: int = 0
    gimbal_device_id: int = 0
    primary_control_sysid: int = 0
    primary_control_compid: int = 0
