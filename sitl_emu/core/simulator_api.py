"""The seam: PX4's simulator API messages as records, and the channels that carry them.

Names, units and field order are MAVLink's (https://mavlink.io/en/messages/common.html, HIL_SENSOR and following), in
*wire order*, so that a record packs as it stands. Between simulator and autopilot they pass over a `Channel`, which is
memory (`memory_channel`) or TCP 4560+i (`tcp_channel.py`); both carry the very same bytes, so both fly bit-identically.
What the API lacks travels beside it, and a real PX4 does without: BATTERY_STATUS_V2, ESC_STATUS and RANGING_BEACON to
the autopilot (a real PX4 simulates its own battery and speed controllers, and ignores them), and CAMERA_IMAGE_CAPTURED;
to the simulator PARAM_VALUE, of the parameters that are about it, HEARTBEAT, of an autopilot that boots or powers off,
GIMBAL_DEVICE_ATTITUDE_STATUS, of a gimbal that carries a camera, CAMERA_SETTINGS, of a camera that zooms,
CAMERA_TRIGGER, of one that takes a picture, and VIDEO_STREAM_STATUS, of one whose video was started or stopped.
The latter come before the HIL_ACTUATOR_CONTROLS of their tick, so that lockstep holds for them.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, Final, NamedTuple, Protocol, TypeVar, cast

from sitl_emu.core.c_types import Layout

FIELDS_UPDATED_ACCEL: Final = 0b111
FIELDS_UPDATED_GYRO: Final = 0b111000
FIELDS_UPDATED_MAG: Final = 0b111000000
FIELDS_UPDATED_BARO: Final = 0b1101000000000
"""Bits of HIL_SENSOR.fields_updated (HIL_SENSOR_UPDATED_FLAGS): absolute pressure, pressure altitude, temperature."""


class HilSensor(NamedTuple):
    """HIL_SENSOR (107): IMU, magnetometer and barometer in the body frame (FRD)."""

    time_usec: int
    xacc: float
    yacc: float
    zacc: float
    xgyro: float
    ygyro: float
    zgyro: float
    xmag: float
    ymag: float
    zmag: float
    abs_pressure: float
    diff_pressure: float
    pressure_alt: float
    temperature: float
    fields_updated: int
    id: int
    """m/s², rad/s, gauss, hPa, m, °C."""


class HilGps(NamedTuple):
    """HIL_GPS (113): a GNSS receiver."""

    time_usec: int
    lat: int
    lon: int
    alt: int
    eph: int
    epv: int
    vel: int
    vn: int
    ve: int
    vd: int
    cog: int
    fix_type: int
    satellites_visible: int
    id: int
    yaw: int
    """1e-7 deg, mm AMSL, cm (HDOP, VDOP x 100), cm/s, cdeg."""


class DistanceSensor(NamedTuple):
    """DISTANCE_SENSOR (132): a single-beam lidar; distances in cm."""

    time_boot_ms: int
    min_distance: int
    max_distance: int
    current_distance: int
    type: int
    id: int
    orientation: int
    covariance: int
    horizontal_fov: float
    vertical_fov: float
    quaternion: tuple[float, float, float, float]
    signal_quality: int


class HilStateQuaternion(NamedTuple):
    """HIL_STATE_QUATERNION (115): ground truth. An autopilot may log it, never fly by it."""

    time_usec: int
    attitude_quaternion: tuple[float, float, float, float]
    rollspeed: float
    pitchspeed: float
    yawspeed: float
    lat: int
    lon: int
    alt: int
    vx: int
    vy: int
    vz: int
    ind_airspeed: int
    true_airspeed: int
    xacc: int
    yacc: int
    zacc: int


class SimulatedBattery(NamedTuple):
    """What BATTERY_STATUS_V2 (369) carries of the simulated battery: V, A (NaN: nobody measures it), percent."""

    voltage: float
    current: float
    state_of_charge: float


class EscTelemetry(NamedTuple):
    """What ESC_STATUS (291) carries of up to four speed controllers, from number `first` on: revolutions a minute."""

    time_usec: int
    first: int
    rpm: tuple[int, ...]


class RangingBeacon(NamedTuple):
    """RANGING_BEACON (510): the distance to a radio beacon, and its place."""

    time_usec: int
    range: int
    lat: int
    lon: int
    alt: float
    hacc_est: int
    vacc_est: int
    range_accuracy: int
    beacon_id: int
    """mm, 1e-7 deg, m above the ellipsoid."""


class HilActuatorControls(NamedTuple):
    """HIL_ACTUATOR_CONTROLS (93): outputs in the order of PWM_MAIN_FUNCn; motors 0..1, servos -1..1.

    `time_usec` says when the outputs were made: the same ones come again until there are new ones (a real PX4 answers
    when it has made some, SimulatorMavlink::send; SIH's rover rolls on without). With LOCKSTEP in `flags` it is in
    HIL_SENSOR's time. `mode` is MAV_MODE_FLAG (bit 128: armed, bit 2: actuators are tested); an unarmed motor that is
    not tested is 0.
    """

    time_usec: int
    flags: int
    controls: tuple[float, ...]
    mode: int


class SimulatorParameter(NamedTuple):
    """What PARAM_VALUE (22) carries of a parameter that is about the simulator; the value is a float32."""

    name: str
    value: float


class AutopilotState(NamedTuple):
    """What HEARTBEAT (0) carries of an autopilot: MAV_STATE, of which BOOT and POWEROFF mean something to a simulator.

    BOOT: it begins anew, after a reboot. POWEROFF: this answer was its last.
    """

    system_status: int


class GimbalState(NamedTuple):
    """What GIMBAL_DEVICE_ATTITUDE_STATUS (285) carries of a gimbal: where what it carries looks (w, x, y, z).

    Roll and pitch are against the horizon, yaw against the vehicle's heading; the numbers are float32.
    """

    q: tuple[float, float, float, float]


class CameraZoom(NamedTuple):
    """What CAMERA_SETTINGS (260) carries of a camera: its zoom, percent of its range, 0 being wide; a float32."""

    percent: float


class CameraTrigger(NamedTuple):
    """What CAMERA_TRIGGER (112) carries of a camera that opens its shutter: the picture's number on its card."""

    number: int


class VideoState(NamedTuple):
    """What VIDEO_STREAM_STATUS (270) carries of a camera's video: whether it is to be sent (`flags`)."""

    running: bool


class PictureTaken(NamedTuple):
    """What CAMERA_IMAGE_CAPTURED (263) carries of a picture that was asked for by CAMERA_TRIGGER: its file is there."""

    number: int
    ok: bool
    """Else it could not be drawn."""


SIMULATOR_PARAMETERS = (
    "BAT1_N_CELLS",
    "BAT1_V_CHARGED",
    "BAT1_V_EMPTY",
    "SIH_DISTSNSR_MAX",
    "SIH_DISTSNSR_MIN",
    "SIH_DISTSNSR_OVR",
    "SIH_IXX",
    "SIH_IYY",
    "SIH_IZZ",
    "SIH_KDV",
    "SIH_KDW",
    "SIH_L_PITCH",
    "SIH_L_ROLL",
    "SIH_MASS",
    "SIH_Q_MAX",
    "SIH_RNGBC_NOISE",
    "SIH_T_MAX",
    "SIH_T_TAU",
    "SIH_WIND_E",
    "SIH_WIND_N",
    "SIM_BARO_OFF_P",
    "SIM_BARO_OFF_T",
    "SIM_BAT_DRAIN",
    "SIM_BAT_MIN_PCT",
    "SIM_GPS_USED",
    "SIM_MAG_OFFSET_X",
    "SIM_MAG_OFFSET_Y",
    "SIM_MAG_OFFSET_Z",
)
"""PX4's parameters that an autopilot tells its simulator. PX4's own (SIH) is part of it, and reads them itself."""
STATE_BOOT: Final = 1
STATE_POWEROFF: Final = 7
"""MAV_STATE_BOOT, MAV_STATE_POWEROFF."""

BesideMessage = SimulatorParameter | AutopilotState | GimbalState | CameraZoom | CameraTrigger | VideoState
"""What an autopilot says beside its answers."""
SimulatorMessage = (
    HilSensor
    | HilGps
    | DistanceSensor
    | HilStateQuaternion
    | SimulatedBattery
    | EscTelemetry
    | RangingBeacon
    | PictureTaken
)

HIL_SENSOR_LAYOUT = Layout("Q13fIB")
HIL_GPS_LAYOUT = Layout("QiiiHHHhhhHBBBH")
DISTANCE_SENSOR_LAYOUT = Layout("IHHHBBBBff4fB")
HIL_ACTUATOR_CONTROLS_LAYOUT = Layout("QQ16fB")
BATTERY_STATUS_V2_LAYOUT = Layout("5fIhB")
GIMBAL_LAYOUT = Layout("I4f3fIHBB")
CAMERA_SETTINGS_LAYOUT = Layout("IBffB")
NO_TEMPERATURE: Final = 0x7FFF
CONTROLS: Final = 16
LOCKSTEP: Final = 1
"""Bit of HIL_ACTUATOR_CONTROLS.flags: HIL_ACTUATOR_CONTROLS_FLAGS_LOCKSTEP."""
YAW_IN_VEHICLE_FRAME: Final = 32
"""Bit of GIMBAL_DEVICE_ATTITUDE_STATUS.flags."""


def as_on_the_wire(message: SimulatorMessage) -> SimulatorMessage:
    """The record with the values that the wire can carry (float32 and the wire's integers)."""
    if isinstance(message, HilSensor):
        return HilSensor._make(HIL_SENSOR_LAYOUT.unpack(HIL_SENSOR_LAYOUT.pack(*message)))
    if isinstance(message, DistanceSensor):
        return unpack_distance(pack_distance(message))
    if isinstance(message, HilGps):
        return HilGps._make(HIL_GPS_LAYOUT.unpack(HIL_GPS_LAYOUT.pack(*message)))
    if isinstance(message, SimulatedBattery):
        return unpack_battery(pack_battery(message))
    return message


def actuators_as_on_the_wire(message: HilActuatorControls) -> HilActuatorControls:
    """The record with its controls rounded to float32 and filled up to 16."""
    return unpack_controls(pack_controls(message))


def pack_distance(message: DistanceSensor) -> bytes:
    """The payload of DISTANCE_SENSOR."""
    return DISTANCE_SENSOR_LAYOUT.pack(*message[:10], *message.quaternion, message.signal_quality)


def unpack_distance(payload: bytes) -> DistanceSensor:
    """The record of a whole payload."""
    fields = DISTANCE_SENSOR_LAYOUT.unpack(payload)
    return DistanceSensor._make((*fields[:10], fields[10:14], fields[14]))


def pack_battery(message: SimulatedBattery) -> bytes:
    """The payload of BATTERY_STATUS_V2, which counts no capacity and knows no temperature."""
    voltage, current, state_of_charge = message
    return BATTERY_STATUS_V2_LAYOUT.pack(voltage, current, math.nan, math.nan, state_of_charge, 0, NO_TEMPERATURE, 0)


def unpack_battery(payload: bytes) -> SimulatedBattery:
    """The record of a whole payload."""
    voltage, current, _, _, state_of_charge, *_ = BATTERY_STATUS_V2_LAYOUT.unpack(payload)
    return SimulatedBattery(voltage, current, state_of_charge)


def pack_controls(message: HilActuatorControls) -> bytes:
    """The payload of HIL_ACTUATOR_CONTROLS; controls that are not given are 0."""
    controls = message.controls
    if len(controls) < CONTROLS:
        controls = controls + (0.0,) * (CONTROLS - len(controls))
    return HIL_ACTUATOR_CONTROLS_LAYOUT.pack(message.time_usec, message.flags, *controls, message.mode)


def unpack_controls(payload: bytes) -> HilActuatorControls:
    """The record of a whole payload."""
    fields = HIL_ACTUATOR_CONTROLS_LAYOUT.unpack(payload)
    return HilActuatorControls(fields[0], fields[1], fields[2:18], fields[18])


def pack_gimbal(message: GimbalState) -> bytes:
    """The payload of GIMBAL_DEVICE_ATTITUDE_STATUS."""
    return GIMBAL_LAYOUT.pack(0, *message.q, 0.0, 0.0, 0.0, 0, YAW_IN_VEHICLE_FRAME, 0, 0)


def unpack_gimbal(payload: bytes) -> GimbalState:
    """The record of a whole payload."""
    w, x, y, z = GIMBAL_LAYOUT.unpack(payload)[1:5]
    return GimbalState((w, x, y, z))


def pack_zoom(message: CameraZoom) -> bytes:
    """The payload of CAMERA_SETTINGS."""
    return CAMERA_SETTINGS_LAYOUT.pack(0, 0, message.percent, 0.0, 0)


def unpack_zoom(payload: bytes) -> CameraZoom:
    """The record of a whole payload."""
    return CameraZoom(CAMERA_SETTINGS_LAYOUT.unpack(payload)[2])


def beside_as_on_the_wire(message: BesideMessage) -> BesideMessage:
    """The record with its numbers rounded to float32, where it has any that are not already."""
    if isinstance(message, GimbalState):
        return unpack_gimbal(pack_gimbal(message))
    if isinstance(message, CameraZoom):
        return unpack_zoom(pack_zoom(message))
    return message


Timed = TypeVar("Timed", SimulatorMessage, HilActuatorControls)


def later(message: Timed, by_us: int) -> Timed:
    """The record with its time moved: to the clock of an autopilot that boots while its simulator runs, or back."""
    moved: Any = message
    if isinstance(message, DistanceSensor):
        moved = moved._replace(time_boot_ms=message.time_boot_ms + by_us // 1000)
    elif not isinstance(message, SimulatedBattery | PictureTaken):
        moved = moved._replace(time_usec=moved.time_usec + by_us)
    return cast(Timed, moved)


class ChannelClosed(Exception):
    """The other end of a channel has gone; the text says which and why."""


class AutopilotChannel(Protocol):
    """The autopilot's end. A tick is: `receive` (blocks until HIL_SENSOR came), step, `send`."""

    def receive(self) -> list[SimulatorMessage]:
        """What came up to and with the next HIL_SENSOR, in order. Raises ChannelClosed."""
        ...

    def send(self, controls: HilActuatorControls, beside: Sequence[BesideMessage] = ()) -> None:
        """Answer a HIL_SENSOR; `beside` comes first. Raises ChannelClosed."""
        ...


class SimulatorChannel(Protocol):
    """The simulator's end."""

    def send(self, messages: list[SimulatorMessage]) -> None:
        """Send one tick's messages, HIL_SENSOR last. Raises ChannelClosed."""
        ...

    def receive(self) -> HilActuatorControls:
        """The answer to the last HIL_SENSOR; blocks. Raises ChannelClosed."""
        ...

    def beside(self) -> Sequence[BesideMessage]:
        """What came beside the answers since this was asked last, in order."""
        ...


class MemoryChannel:
    """Both ends in one process, for `launch`: lists instead of sockets, the wire's values all the same."""

    def __init__(self) -> None:
        to_autopilot: deque[list[SimulatorMessage]] = deque()
        to_simulator: deque[HilActuatorControls] = deque()
        beside: list[BesideMessage] = []
        self.autopilot: AutopilotChannel = _MemoryAutopilotEnd(to_autopilot, to_simulator, beside)
        self.simulator: SimulatorChannel = _MemorySimulatorEnd(to_autopilot, to_simulator, beside)


class _MemoryAutopilotEnd:
    def __init__(
        self, inbox: deque[list[SimulatorMessage]], outbox: deque[HilActuatorControls], beside: list[BesideMessage]
    ) -> None:
        self._inbox, self._outbox, self._beside = inbox, outbox, beside

    def receive(self) -> list[SimulatorMessage]:
        return self._inbox.popleft()

    def send(self, controls: HilActuatorControls, beside: Sequence[BesideMessage] = ()) -> None:
        self._beside += map(beside_as_on_the_wire, beside)
        self._outbox.append(actuators_as_on_the_wire(controls))


class _MemorySimulatorEnd:
    def __init__(
        self, outbox: deque[list[SimulatorMessage]], inbox: deque[HilActuatorControls], beside: list[BesideMessage]
    ) -> None:
        self._outbox, self._inbox, self._beside = outbox, inbox, beside

    def send(self, messages: list[SimulatorMessage]) -> None:
        self._outbox.append([as_on_the_wire(message) for message in messages])

    def receive(self) -> HilActuatorControls:
        return self._inbox.popleft()

    def beside(self) -> Sequence[BesideMessage]:
        if not self._beside:
            return ()
        said = self._beside[:]
        self._beside.clear()
        return said
