"""Control allocation of a multicopter: from torques and thrust to motors.

PX4's control_allocator for CA_AIRFRAME 0 (src/modules/control_allocator, v1.18): effectiveness by the rotors' geometry
(CA_ROTORn_*), pseudo-inverse, normalised as PX4 does, then sequential desaturation: thrust gives way first, then roll
and pitch, and yaw keeps what is left; with CA_METHOD 0 each motor ends at its limit instead. With MC_AIRMODE thrust may
also get more, so that roll and pitch (1), and yaw as well (2), turn the vehicle at no throttle as they do in hover.
THR_MDL_FAC turns thrust into motor signal. The matrix is worked out by numpy once; a tick is plain Python. A motor with
CA_Rn_SLEW takes so many seconds from end to end, one with its bit of CA_R_REV turns backwards, too. Tilting rotors and
a matrix without a motor that failed are left out.
"""

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sitl_emu.autopilot.constants import MOST_ROTORS
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import Vector3

SMALL_FACTOR: Final = 1e-3
WEAK_AUTHORITY: Final = 0.05
"""An axis along which no motor does more is not controlled (update_effectiveness_matrix_if_needed)."""
FARTHEST_M: Final = 1000.0
"""A rotor is nowhere farther out, whatever its parameters say."""
YAW_MARGIN: Final = 0.15
"""Above full thrust, what yaw may ask for: then thrust gives way (PX4's MINIMUM_YAW_MARGIN)."""
WEAK: Final = 0.2
"""A motor that does less along an axis brings nobody back into range by it (computeDesaturationGain)."""
RESOLUTION: Final = 1e-6
ACHIEVED: Final = 1e-6
"""Square of what may be missing of a setpoint that counts as achieved."""
ACTUATORS: Final = 16
AT_LOWER_END: Final = -2
AT_UPPER_END: Final = 2
"""control_allocator_status.actuator_saturation."""
FLOAT_EPSILON: Final = 1.2e-7
NOTHING: Vector3 = (0.0, 0.0, 0.0)
ROLL_PITCH: Final = 1
ROLL_PITCH_YAW: Final = 2
"""MC_AIRMODE."""


class Rotor(NamedTuple):
    """CA_ROTORn_*: position (m, or any common unit), axis of thrust, thrust and moment coefficients."""

    px: float
    py: float
    pz: float
    ax: float
    ay: float
    az: float
    ct: float
    km: float


def rotors_of(parameters: Parameters) -> list[Rotor]:
    """As many as CA_ROTOR_COUNT says."""
    count = max(0, min(MOST_ROTORS, int(parameters["CA_ROTOR_COUNT"])))
    fields = ("PX", "PY", "PZ", "AX", "AY", "AZ", "CT", "KM")
    return [Rotor(*(float(parameters[f"CA_ROTOR{n}_{field}"]) for field in fields)) for n in range(count)]


def effectiveness_of(rotors: list[Rotor]) -> NDArray[Any]:
    """What each rotor does at full thrust: torques and thrusts along x, y and z (FRD), shape 6 x n.

    What all of them do too weakly to be controlled is 0.
    """
    effectiveness = np.zeros((6, len(rotors)))
    for index, (px, py, pz, ax, ay, az, ct, km) in enumerate(rotors):
        axis = np.array((ax, ay, az))
        axis = axis / (float(np.linalg.norm(axis)) or 1.0)
        position = np.clip((px, py, pz), -FARTHEST_M, FARTHEST_M)
        effectiveness[:3, index] = ct * np.cross(position, axis) - ct * km * axis
        effectiveness[3:, index] = ct * axis
    effectiveness[(np.abs(effectiveness) <= WEAK_AUTHORITY).all(axis=1)] = 0.0
    return effectiveness


def mixer(rotors: list[Rotor]) -> list[list[float]]:
    """Columns of the normalised pseudo-inverse: motors by roll, pitch, yaw and (last) thrust down; shape 4 x n."""
    effectiveness = effectiveness_of(rotors)
    if not len(rotors) or not np.isfinite(effectiveness).all():
        return [[0.0] * len(rotors)] * 4
    mix = np.linalg.pinv(effectiveness)
    roll, pitch, yaw, thrust = mix[:, 0], mix[:, 1], mix[:, 2], mix[:, 5]
    scale = max(_root_mean_square(roll), _root_mean_square(pitch))
    columns = [
        roll / scale,
        pitch / scale,
        yaw / (float(np.max(yaw)) or 1.0),
        thrust / _mean_size(thrust),
    ]
    return [[float(value) if abs(value) >= SMALL_FACTOR else 0.0 for value in column] for column in columns]


def _root_mean_square(column: NDArray[Any]) -> float:
    acting = np.count_nonzero(np.abs(column) > SMALL_FACTOR)
    return math.sqrt(float(column @ column) / (acting / 2.0)) if acting else 1.0


def _mean_size(column: NDArray[Any]) -> float:
    sizes = np.abs(column)
    acting = sizes[sizes > FLOAT_EPSILON]
    return float(np.mean(acting)) if len(acting) else 1.0


def effects(rows: list[tuple[float, float, float, float]]) -> list[list[float]]:
    """What each motor gives of roll, pitch, yaw and thrust down: the inverse of the mixer's rows; shape 4 x n."""
    if not rows:
        return [[]] * 4
    inverse = np.linalg.pinv(np.array(rows))
    return [[float(value) for value in effect] for effect in inverse]


class ControlAllocator:
    """`unallocated` is the torque (roll, pitch, yaw) that the last call could not give, `unallocated_thrust` the thrust
    along body z, and `thrusts` what it asked of each motor: 0..1."""

    def __init__(
        self,
        rotors: list[Rotor],
        thrust_model_factor: float,
        air_mode: int = 0,
        slew_s: tuple[float, ...] = (),
        reversible_flags: int = 0,
        *,
        desaturates: bool = True,
    ) -> None:
        """`thrust_model_factor`: THR_MDL_FAC, share of the thrust that goes with the square of the signal; `slew_s`:
        CA_Rn_SLEW of each motor, 0 for as quick as it gets; `reversible_flags`: CA_R_REV; `desaturates`: CA_METHOD."""
        self._desaturates = desaturates
        self._backwards = reversible_flags & (1 << len(rotors)) - 1 != 0
        self._ends = [(-1.0 if reversible_flags >> n & 1 else 0.0, 1.0) for n in range(len(rotors))]
        self._ends_with_yaw = [(least, most + YAW_MARGIN * (most - least)) for least, most in self._ends]
        self._slew_s = slew_s if any(each > FLOAT_EPSILON for each in slew_s) else ()
        self._air_mode = air_mode
        self._roll, self._pitch, self._yaw, self._thrust = mixer(rotors)
        self._rows = list(zip(self._roll, self._pitch, self._yaw, self._thrust, strict=True))
        self._factor = max(0.0, min(1.0, thrust_model_factor))
        self._yaw_most = max(map(abs, self._yaw), default=0.0)
        self._effects = effects(self._rows)
        self.unallocated: Vector3 = NOTHING
        self.unallocated_thrust = 0.0
        self.thrusts: list[float] = []

    def allocate(self, roll: float, pitch: float, yaw: float, thrust_z: float, dt_s: float = 0.0) -> tuple[float, ...]:
        """Motor signals for torques and thrust along body z (negative is up), `dt_s` after the last: 0..1, or -1..1 of
        those that turn both ways."""
        if not self._rows:
            return ()
        motors = [r * roll + p * pitch + y * yaw + t * thrust_z for r, p, y, t in self._rows]
        # Neither with nor without yaw may a motor leave its range: else there is something to give up.
        reach = abs(yaw) * self._yaw_most
        if min(motors) < reach or max(motors) > 1.0 - reach:
            if self._desaturates:
                level = [r * roll + p * pitch + t * thrust_z for r, p, _, t in self._rows]
                motors = self._desaturated(level, yaw)
            motors = self._clipped(motors)
            self._note_missing(motors, roll, pitch, yaw, thrust_z)
        else:
            self.unallocated, self.unallocated_thrust = NOTHING, 0.0
        if self._slew_s:
            motors = self._slewed(motors, dt_s)
            self._note_missing(motors, roll, pitch, yaw, thrust_z)
        self.thrusts = motors
        factor = self._factor
        if self._backwards:
            return tuple([math.copysign(self.signal(abs(m)), m) for m in motors])
        if factor == 1.0:
            return tuple([math.sqrt(m) if m > 0.0 else 0.0 for m in motors])
        if factor == 0.0:
            return tuple(motors)
        return tuple([self.signal(m) for m in motors])

    def signal(self, thrust: float) -> float:
        """Motor signal 0..1 for a thrust 0..1: thrust = factor * signal² + (1 - factor) * signal."""
        factor = self._factor
        if factor == 0.0:
            return thrust
        shift = (1.0 - factor) / (2.0 * factor)
        return math.sqrt(max(0.0, shift * shift + thrust / factor)) - shift

    def rest(self) -> None:
        """No motor turns."""
        self.thrusts = []

    def _slewed(self, motors: list[float], dt_s: float) -> list[float]:
        """As far towards `motors` as it goes in this time (applySlewRateLimit)."""
        slewed = []
        for index, motor in enumerate(motors):
            slew_s = self._slew_s[index]
            if slew_s > FLOAT_EPSILON:
                least, most = self._ends[index]
                before, step = self.thrusts[index] if self.thrusts else 0.0, dt_s * (most - least) / slew_s
                motor = max(before - step, min(before + step, motor))
            slewed.append(motor)
        return slewed

    def _desaturated(self, level: list[float], yaw: float) -> list[float]:
        """`level`: motors without yaw (mixAirmodeDisabled, mixAirmodeRP, mixAirmodeRPY)."""
        ends = self._ends
        if self._air_mode == ROLL_PITCH_YAW:
            motors = [m + y * yaw for m, y in zip(level, self._yaw, strict=True)]
            motors = desaturate(motors, self._thrust, ends)
            return desaturate(motors, self._yaw, ends)
        motors = desaturate(level, self._thrust, ends, reduce_only=self._air_mode != ROLL_PITCH)
        if self._air_mode != ROLL_PITCH:
            motors = desaturate(motors, self._roll, ends)
            motors = desaturate(motors, self._pitch, ends)
        motors = [m + y * yaw for m, y in zip(motors, self._yaw, strict=True)]
        motors = desaturate(motors, self._yaw, self._ends_with_yaw)
        return desaturate(motors, self._thrust, ends, reduce_only=True)

    def _clipped(self, motors: list[float]) -> list[float]:
        """Each within its ends."""
        return [min(most, max(least, m)) for m, (least, most) in zip(motors, self._ends, strict=True)]

    def _note_missing(self, motors: list[float], *asked: float) -> None:
        """What was asked for, less what these motors give."""
        missing = []
        for effect, wanted in zip(self._effects, asked, strict=True):
            rest = wanted - sum([e * m for e, m in zip(effect, motors, strict=True)])
            missing.append(rest if abs(rest) > RESOLUTION else 0.0)
        self.unallocated, self.unallocated_thrust = (missing[0], missing[1], missing[2]), missing[3]


def saturation(motors: list[float], reversible_flags: int = 0) -> tuple[int, ...]:
    """actuator_saturation of all; who is not there has both ends at 0, and PX4 looks at the upper first. NaN is off."""
    found = [AT_UPPER_END] * ACTUATORS
    for index, motor in enumerate(motors[:ACTUATORS]):
        upper, least = motor > 1.0 - FLOAT_EPSILON, -1.0 if reversible_flags >> index & 1 else 0.0
        found[index] = AT_UPPER_END if upper else AT_LOWER_END if motor < least + FLOAT_EPSILON else 0
    return tuple(found)


def desaturate(
    motors: list[float], vector: list[float], ends: list[tuple[float, float]], reduce_only: bool = False
) -> list[float]:
    """Add so much of `vector` that as many motors as possible come back within their `ends`.

    Twice, as PX4 does: the whole gain, then half of what the other end asks back. `reduce_only`: thrust may only
    get less.
    """
    gain = _gain(motors, vector, ends)
    if reduce_only and gain < 0.0:
        return motors
    motors = [m + gain * v for m, v in zip(motors, vector, strict=True)]
    gain = 0.5 * _gain(motors, vector, ends)
    return [m + gain * v for m, v in zip(motors, vector, strict=True)]


def _gain(motors: list[float], vector: list[float], ends: list[tuple[float, float]]) -> float:
    lowest = highest = 0.0
    for m, v, (least, most) in zip(motors, vector, ends, strict=True):
        if -WEAK < v < WEAK:
            continue
        if m < least:
            k = (least - m) / v
        elif m > most:
            k = (most - m) / v
        else:
            continue
        lowest, highest = min(lowest, k), max(highest, k)
    return lowest + highest
