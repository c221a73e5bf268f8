"""What a vehicle is, as plain data: the records that `vehicles/<model>/vehicle.toml` is read into.

Body frame FRD, SI units; every number's source stands as a comment in the TOML file. PX4's side of a vehicle is its
airframe (`airframe.json`): parameters that differ from PX4's defaults.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from sitl_emu.vehicles.image_sensor import PLAIN, SENSORS, ImageSensor
from sitl_emu.vehicles.record import Limits, Words

Vector3 = tuple[float, float, float]
ZERO: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Part:
    """A cuboid of the vehicle, for its inertia: `size_m` along x, y, z; `count` tells how many share the mass each."""

    name: str
    mass_kg: Annotated[float, Limits(0.0)]
    size_m: Annotated[Vector3, Limits(0.0)]
    centre_m: Vector3 = ZERO


@dataclass(frozen=True, slots=True)
class Rotor:
    """Place of a rotor relative to the centre of mass; a `ccw` rotor (seen from above) yaws the body to the right."""

    position_m: Vector3
    turns: Annotated[str, Words(("ccw", "cw"))]


@dataclass(frozen=True, slots=True)
class Propulsion:
    """Rotors whose thrust is thrust_max_n · u², u being their speed over the greatest, which lags its command."""

    thrust_max_n: Annotated[float, Limits(0.01)]
    torque_per_thrust_m: Annotated[float, Limits(0.0)]
    time_constant_s: Annotated[float, Limits(0.001)]
    power_max_w: Annotated[float, Limits(0.0)]
    """Electrical power of one rotor at full thrust; it grows with u³."""
    rotors: tuple[Rotor, ...]
    angular_momentum_max_kg_m2_s: Annotated[float, Limits(0.0)] = 0.0
    """Of one rotor at full speed, for the gyroscopic moment."""


@dataclass(frozen=True, slots=True)
class Aerodynamics:
    """Drag by body axis, against the air: force (linear + quadratic · |v|) · v, moment angular · ω."""

    linear_n_s_m: Annotated[Vector3, Limits(0.0)]
    angular_n_m_s: Annotated[Vector3, Limits(0.0)]
    quadratic_n_s2_m2: Annotated[Vector3, Limits(0.0)] = ZERO


@dataclass(frozen=True, slots=True)
class Gear:
    """Landing gear: half the stance along x and y, height of the centre of mass above its feet, friction."""

    half_length_m: Annotated[float, Limits(0.01)]
    half_width_m: Annotated[float, Limits(0.01)]
    height_m: Annotated[float, Limits(0.0)]
    friction: Annotated[float, Limits(0.0, 5.0)] = 0.7
    crash_speed_m_s: Annotated[float, Limits(0.0, math.inf)] = math.inf
    """Closing speed at which the ground breaks it."""
    is_px4s: bool = False
    """It stands as in PX4's SIH: held where it is while the forces on it point down; stance and friction do nothing."""


@dataclass(frozen=True, slots=True)
class Sphere:
    """A part of the vehicle as others meet it; its centre relative to the centre of mass."""

    centre_m: Vector3
    radius_m: Annotated[float, Limits(0.001)]


@dataclass(frozen=True, slots=True)
class Body:
    """What solids and other vehicles touch: a few spheres, how they bounce and slide, and what breaks them."""

    spheres: tuple[Sphere, ...]
    crash_speed_m_s: Annotated[float, Limits(0.0)]
    """Closing speed along the contact's normal above which the vehicle is wrecked."""
    restitution: Annotated[float, Limits(0.0, 1.0)] = 0.2
    friction: Annotated[float, Limits(0.0, 2.0)] = 0.5


@dataclass(frozen=True, slots=True)
class Parcel:
    """A box of even density that a vehicle carries and can let go; `size_m` along x, y, z."""

    mass_kg: Annotated[float, Limits(0.001)]
    size_m: Annotated[Vector3, Limits(0.001)]
    centre_m: Vector3
    """Where it hangs, from the centre of mass of the vehicle without it."""
    drag_m2: Annotated[float, Limits(0.0)] = 0.0
    """Drag coefficient times area, the same from all sides: what it adds to the vehicle's drag, and falls with."""
    friction: Annotated[float, Limits(0.0, 2.0)] = 0.6
    restitution: Annotated[float, Limits(0.0, 1.0)] = 0.1
    rolling_m: Annotated[float, Limits(0.0, 1.0)] = 0.0
    """How it bounces, slides and rolls: as of loose bodies (docs/worlds.md)."""


@dataclass(frozen=True, slots=True)
class Release:
    """What holds a parcel. Any of its outputs opens it, as PX4's gripper does when it releases."""

    outputs: Annotated[tuple[int, ...], Limits(1, 16)]
    """n of the PWM_MAIN_FUNCn: HIL_ACTUATOR_CONTROLS, counted from 1."""
    parcel: Parcel
    """What it carries where a scenario says `parcel`, but for the figures that are given there."""


@dataclass(frozen=True, slots=True)
class Chassis:
    """An Ackermann-steered chassis with rear motor; see `vehicles/ackermann.py` for what each number does."""

    wheelbase_m: Annotated[float, Limits(0.05)]
    track_m: Annotated[float, Limits(0.05)]
    centre_to_rear_axle_m: Annotated[float, Limits(0.0)]
    centre_height_m: Annotated[float, Limits(0.0)]
    max_steer_angle_rad: Annotated[float, Limits(0.05, 1.2)]
    steer_time_constant_s: Annotated[float, Limits(0.001)]
    stall_force_n: Annotated[float, Limits(1.0)]
    free_speed_m_s: Annotated[float, Limits(0.1)]
    motor_time_constant_s: Annotated[float, Limits(0.001)]
    rolling_resistance: Annotated[float, Limits(0.0, 1.0)]
    holding_friction: Annotated[float, Limits(0.0, 2.0)]
    tyre_friction: Annotated[float, Limits(0.05, 2.0)]
    cornering_stiffness_n_rad: Annotated[float, Limits(1.0)]
    suspension_rad_s: Annotated[float, Limits(2.0, 100.0)]
    motor_efficiency: Annotated[float, Limits(0.05, 1.0)]


@dataclass(frozen=True, slots=True)
class SihRover:
    """PX4's SIH Ackermann rover (`vehicles/sih_ackermann.py`), under its parameters' and constants' names."""

    kdv: Annotated[float, Limits(0.0)]
    kdw: Annotated[float, Limits(0.0)]
    thrust_time_constant_s: Annotated[float, Limits(0.001)]
    throttle_force_max_n: Annotated[float, Limits(0.0)]
    steer_angle_max_rad: Annotated[float, Limits(0.05, 1.2)]
    wheelbase_m: Annotated[float, Limits(0.05)]
    cornering_stiffness_n_rad: Annotated[float, Limits(1.0)]
    static_friction: Annotated[float, Limits(0.0)]
    kinetic_friction: Annotated[float, Limits(0.0)]
    rolling_friction: Annotated[float, Limits(0.0)]


@dataclass(frozen=True, slots=True)
class Battery:
    """`load`: state of charge and sag follow the current. `px4`: PX4's BatterySimulator (see `vehicles/battery.py`)."""

    kind: Annotated[str, Words(("load", "px4"))]
    cells: Annotated[int, Limits(1, 20)]
    cell_full_v: Annotated[float, Limits(2.5, 4.5)]
    cell_empty_v: Annotated[float, Limits(2.5, 4.5)]
    capacity_ah: Annotated[float, Limits(0.01)] = 1.0
    internal_resistance_ohm: Annotated[float, Limits(0.0)] = 0.0
    avionics_power_w: Annotated[float, Limits(0.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Imu:
    """Standard deviations of one 250 Hz sample (white), moving and at rest, and of the biases drawn at start."""

    accel_noise_m_s2: Annotated[Vector3, Limits(0.0)]
    accel_noise_still_m_s2: Annotated[Vector3, Limits(0.0)]
    gyro_noise_rad_s: Annotated[Vector3, Limits(0.0)]
    gyro_noise_still_rad_s: Annotated[Vector3, Limits(0.0)]
    accel_bias_m_s2: Annotated[float, Limits(0.0)] = 0.0
    gyro_bias_rad_s: Annotated[float, Limits(0.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Magnetometer:
    """White noise per axis of one sample (gauss), hard-iron bias left after calibration, rate.

    `early_share`: of its samples so many are of the tick of 4 ms before. PX4's SensorMagSim runs beside SIH's loop and
    takes the newest attitude, sometimes before SIH has told this step's.
    """

    noise_gauss: Annotated[Vector3, Limits(0.0)]
    rate_hz: Annotated[float, Limits(1.0, 250.0)]
    bias_gauss: Annotated[float, Limits(0.0)] = 0.0
    early_share: Annotated[float, Limits(0.0, 1.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Barometer:
    """White noise, and a slow Gauss-Markov drift with its time constant.

    `is_px4s` makes it PX4's SensorBaroSim: its air, which cools with height, and the distribution of its noise.
    """

    noise_pa: Annotated[float, Limits(0.0)]
    rate_hz: Annotated[float, Limits(1.0, 250.0)]
    drift_pa: Annotated[float, Limits(0.0)] = 0.0
    drift_time_s: Annotated[float, Limits(1.0)] = 300.0
    temperature_c: Annotated[float, Limits(-40.0, 85.0)] = 15.0
    is_px4s: bool = False


@dataclass(frozen=True, slots=True)
class Gps:
    """Per-axis standard deviations: white noise and Gauss-Markov drift of position and of velocity; what it reports."""

    rate_hz: Annotated[float, Limits(1.0, 50.0)]
    noise_horizontal_m: Annotated[float, Limits(0.0)]
    noise_vertical_m: Annotated[float, Limits(0.0)]
    drift_horizontal_m: Annotated[float, Limits(0.0)]
    drift_vertical_m: Annotated[float, Limits(0.0)]
    drift_time_s: Annotated[float, Limits(0.01)]
    noise_velocity_m_s: Annotated[float, Limits(0.0)]
    eph_m: Annotated[float, Limits(0.01)]
    epv_m: Annotated[float, Limits(0.01)]
    satellites: Annotated[int, Limits(0, 50)]
    """In use; also what the airframe's SIM_GPS_USED starts from."""
    drift_velocity_horizontal_m_s: Annotated[float, Limits(0.0)] = 0.0
    drift_velocity_vertical_m_s: Annotated[float, Limits(0.0)] = 0.0
    drift_velocity_time_s: Annotated[float, Limits(0.01)] = 1.0


@dataclass(frozen=True, slots=True)
class Lidar:
    """A single beam along body down: range, white noise, rate, and an error that stays as it is."""

    min_distance_m: Annotated[float, Limits(0.0)]
    max_distance_m: Annotated[float, Limits(0.1)]
    noise_m: Annotated[float, Limits(0.0)]
    rate_hz: Annotated[float, Limits(1.0, 100.0)]
    noise_share: Annotated[float, Limits(0.0, 1.0)] = 0.0
    """Of the distance: its noise, where that is more than noise_m."""
    accuracy_m: Annotated[float, Limits(0.0)] = 0.0
    """How wrong it may be for all its life; drawn at start, with half of it as the standard deviation."""
    accuracy_share: Annotated[float, Limits(0.0, 1.0)] = 0.0
    """The same as a share of the distance, where that is more than accuracy_m."""
    tells_quality: bool = True
    """Whether it says how well it sees the ground."""
    is_px4s: bool = False
    """As PX4's SIH has it: where it touches the ground or is in it, it sees nothing valid."""


@dataclass(frozen=True, slots=True)
class Sensors:
    """What a vehicle carries."""

    imu: Imu
    magnetometer: Magnetometer
    barometer: Barometer
    gps: Gps
    lidar: Lidar | None = None


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera that speaks MAVLink (component 100): optics, sensor, storage, and how it is mounted."""

    vendor: str
    model: str
    mount: Annotated[str, Words(("nadir", "mast", "gimbal"))]
    """Where it looks in the body, by the names of `sitl_emu/world/lens.py`; on a gimbal, where that turns it."""
    focal_length_mm: Annotated[float, Limits(0.1)]
    sensor_width_mm: Annotated[float, Limits(0.1)]
    sensor_height_mm: Annotated[float, Limits(0.1)]
    resolution_h_px: Annotated[int, Limits(1, 65535)]
    resolution_v_px: Annotated[int, Limits(1, 65535)]
    frame_rate_hz: Annotated[float, Limits(1.0, 240.0)]
    storage_mib: Annotated[float, Limits(1.0)]
    image_mib: Annotated[float, Limits(0.001)]
    video_mib_s: Annotated[float, Limits(0.001)]
    interval_min_s: Annotated[float, Limits(0.01)]
    """Time that an image takes; no two are taken faster."""
    zoom_max: Annotated[float, Limits(1.0)] = 1.0
    """Focal length at full zoom over that at none."""
    sensor: Annotated[str | ImageSensor, Words(SENSORS)] = PLAIN
    """Its name, or a table: an OV5648 that differs in these figures."""


def zoomed(zoom_max: float, percent: float) -> float:
    """Focal length over that at no zoom, at so many percent of the range: linear between the two, which is ours."""
    return 1.0 + (zoom_max - 1.0) * percent / 100.0


@dataclass(frozen=True, slots=True)
class Gimbal:
    """A gimbal that speaks MAVLink (component 154): limits of its angles, its speed, and where it looks at start."""

    vendor: str
    model: str
    roll_max_deg: Annotated[float, Limits(0.0, 180.0)]
    pitch_min_deg: Annotated[float, Limits(-180.0, 0.0)]
    pitch_max_deg: Annotated[float, Limits(0.0, 180.0)]
    yaw_max_deg: Annotated[float, Limits(0.0, 360.0)]
    rate_max_deg_s: Annotated[float, Limits(0.1, 720.0)]
    start_pitch_deg: Annotated[float, Limits(-180.0, 180.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A vehicle: exactly one of the three kinds of dynamics is described, and `airframe` is PX4's part."""

    model: str
    description: str
    mass_kg: float
    inertia_kg_m2: Vector3
    battery: Battery
    sensors: Sensors
    airframe: Mapping[str, float | int] = field(repr=False)
    propulsion: Propulsion | None = None
    aerodynamics: Aerodynamics | None = None
    gear: Gear | None = None
    chassis: Chassis | None = None
    sih_rover: SihRover | None = None
    camera: Camera | None = None
    gimbal: Gimbal | None = None
    depth: Mapping[str, Any] | None = None
    lidar: Mapping[str, Any] | None = None
    """Figures of its depth camera and of its scanning lidar, named and nested as in a scenario, whose reader checks
    them (`sitl_emu/run/scenario_parts/feeds.py`); the single beam that PX4 flies by is one of the sensors."""
    body: Body | None = None
    """None: nothing touches it but the ground."""
    release: Release | None = None
    parcel: Parcel | None = None
    """What hangs on the release at start."""
    wind_is_px4s: bool = False
    """Wind comes from PX4's SIH_WIND_N/E alone, and not from the world (the reference vehicles)."""
    ranging_beacons: bool = False
    """The radio beacons of PX4's SIH are around."""
    motor_speed_max_rad_s: Annotated[float, Limits(0.0)] = 0.0
    """What its speed controllers tell at full speed; 0: they tell nothing."""
