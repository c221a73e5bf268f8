"""PX4's parameters of its SIH's vehicles (SIH_MASS, SIH_T_MAX, …) as figures of a vehicle's description.

src/modules/simulation/simulator_sih/sih.cpp, parameters_updated (v1.18). They are of SIH's vehicles alone, the
hexacopter and the Ackermann rover; of others they say nothing. Products of inertia are left out. A value that is as
good as what the vehicle's page says changes nothing, so that by default it flies by the page's digits. What SIH can't
reckon with (no mass, no inertia, no time) is not taken.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

from sitl_emu.vehicles.description import Aerodynamics, Lidar, Propulsion, SihRover, Vector3, Vehicle

SAME = 1e-4
"""Of a value (ours): as good as float32, and as places of rotors to a tenth of a millimetre."""
LEAST = 1e-6
"""What has to be more than 0 (ours)."""
LONGEST_M = 327.66
"""What DISTANCE_SENSOR can tell beside heights below the ground (ours: world/sensors/lidar.py)."""
FOREMOST = math.sqrt(3.0) / 2.0
"""How far ahead the foremost rotors of SIH's hexacopter are, over SIH_L_PITCH."""


class Figure(NamedTuple):
    """One parameter: what a vehicle has of it (None: it has none), and the vehicle with another."""

    of: Callable[[Vehicle], float | None]
    put: Callable[[Vehicle, float], Vehicle]
    least: float = LEAST


def with_figure(vehicle: Vehicle, name: str, value: float) -> Vehicle:
    """The vehicle as a parameter of `FIGURES` has it; itself where that is nothing new."""
    figure = FIGURES[name]
    present = figure.of(vehicle)
    if present is None or not value >= figure.least or math.isclose(present, value, rel_tol=SAME):
        return vehicle
    return figure.put(vehicle, value)


def _is_copter(vehicle: Vehicle) -> bool:
    return vehicle.gear is not None and vehicle.gear.is_px4s


def _mass(vehicle: Vehicle) -> float | None:
    return vehicle.mass_kg if _is_copter(vehicle) or vehicle.sih_rover is not None else None


def _inertia(axis: int) -> Figure:
    def of(vehicle: Vehicle) -> float | None:
        return None if _mass(vehicle) is None else vehicle.inertia_kg_m2[axis]

    def put(vehicle: Vehicle, value: float) -> Vehicle:
        x, y, z = vehicle.inertia_kg_m2
        return replace(vehicle, inertia_kg_m2=((value, y, z), (x, value, z), (x, y, value))[axis])

    return Figure(of, put)


def _propulsion(of: Callable[[Propulsion], float], put: Callable[[Propulsion, float], Propulsion]) -> Figure:
    def of_vehicle(vehicle: Vehicle) -> float | None:
        return of(vehicle.propulsion) if vehicle.propulsion is not None and _is_copter(vehicle) else None

    def put_into(vehicle: Vehicle, value: float) -> Vehicle:
        assert vehicle.propulsion is not None
        return replace(vehicle, propulsion=put(vehicle.propulsion, value))

    return Figure(of_vehicle, put_into)


def _torque_max_n_m(propulsion: Propulsion) -> float:
    return propulsion.torque_per_thrust_m * propulsion.thrust_max_n


def _with_thrust(propulsion: Propulsion, thrust_n: float) -> Propulsion:
    """SIH_Q_MAX stays."""
    per_thrust_m = _torque_max_n_m(propulsion) / thrust_n
    return replace(propulsion, thrust_max_n=thrust_n, torque_per_thrust_m=per_thrust_m)


def _with_torque(propulsion: Propulsion, torque_n_m: float) -> Propulsion:
    return replace(propulsion, torque_per_thrust_m=torque_n_m / propulsion.thrust_max_n)


def _arm(axis: int, farthest: float) -> Figure:
    """How far its rotors are from its centre along x (0) or y (1)."""

    def of(propulsion: Propulsion) -> float:
        return max(abs(rotor.position_m[axis]) for rotor in propulsion.rotors) / farthest

    def put(propulsion: Propulsion, arm_m: float) -> Propulsion:
        stretch = [1.0, 1.0]
        stretch[axis] = arm_m / of(propulsion)
        rotors = tuple(
            replace(rotor, position_m=(stretch[0] * x, stretch[1] * y, z))
            for rotor in propulsion.rotors
            for x, y, z in [rotor.position_m]
        )
        return replace(propulsion, rotors=rotors)

    return _propulsion(of, put)


def _lag_s(vehicle: Vehicle) -> float | None:
    if vehicle.sih_rover is not None:
        return vehicle.sih_rover.thrust_time_constant_s
    return vehicle.propulsion.time_constant_s if vehicle.propulsion is not None and _is_copter(vehicle) else None


def _with_lag(vehicle: Vehicle, seconds: float) -> Vehicle:
    if vehicle.sih_rover is not None:
        return replace(vehicle, sih_rover=replace(vehicle.sih_rover, thrust_time_constant_s=seconds))
    assert vehicle.propulsion is not None
    return replace(vehicle, propulsion=replace(vehicle.propulsion, time_constant_s=seconds))


def _resistance(
    of_rover: Callable[[SihRover], float],
    put_rover: Callable[[SihRover, float], SihRover],
    of_air: Callable[[Aerodynamics], Vector3],
    put_air: Callable[[Aerodynamics, Vector3], Aerodynamics],
) -> Figure:
    """Against moving or turning: a rover's one figure, a copter's for each axis."""

    def of(vehicle: Vehicle) -> float | None:
        if vehicle.sih_rover is not None:
            return of_rover(vehicle.sih_rover)
        return of_air(vehicle.aerodynamics)[0] if vehicle.aerodynamics is not None and _is_copter(vehicle) else None

    def put(vehicle: Vehicle, value: float) -> Vehicle:
        if vehicle.sih_rover is not None:
            return replace(vehicle, sih_rover=put_rover(vehicle.sih_rover, value))
        assert vehicle.aerodynamics is not None
        return replace(vehicle, aerodynamics=put_air(vehicle.aerodynamics, (value, value, value)))

    return Figure(of, put, 0.0)


def _lidar(of: Callable[[Lidar], float], put: Callable[[Lidar, float], Lidar]) -> Figure:
    def of_vehicle(vehicle: Vehicle) -> float | None:
        lidar = vehicle.sensors.lidar
        return of(lidar) if lidar is not None and lidar.is_px4s else None

    def put_into(vehicle: Vehicle, value: float) -> Vehicle:
        assert vehicle.sensors.lidar is not None
        lidar = put(vehicle.sensors.lidar, min(value, LONGEST_M))
        return replace(vehicle, sensors=replace(vehicle.sensors, lidar=lidar))

    return Figure(of_vehicle, put_into, 0.0)


FIGURES = {
    "SIH_DISTSNSR_MAX": _lidar(lambda lidar: lidar.max_distance_m, lambda lidar, m: replace(lidar, max_distance_m=m)),
    "SIH_DISTSNSR_MIN": _lidar(lambda lidar: lidar.min_distance_m, lambda lidar, m: replace(lidar, min_distance_m=m)),
    "SIH_IXX": _inertia(0),
    "SIH_IYY": _inertia(1),
    "SIH_IZZ": _inertia(2),
    "SIH_KDV": _resistance(
        lambda rover: rover.kdv,
        lambda rover, kdv: replace(rover, kdv=kdv),
        lambda air: air.linear_n_s_m,
        lambda air, each: replace(air, linear_n_s_m=each),
    ),
    "SIH_KDW": _resistance(
        lambda rover: rover.kdw,
        lambda rover, kdw: replace(rover, kdw=kdw),
        lambda air: air.angular_n_m_s,
        lambda air, each: replace(air, angular_n_m_s=each),
    ),
    "SIH_L_PITCH": _arm(0, FOREMOST),
    "SIH_L_ROLL": _arm(1, 1.0),
    "SIH_MASS": Figure(_mass, lambda vehicle, kg: replace(vehicle, mass_kg=kg)),
    "SIH_Q_MAX": _propulsion(_torque_max_n_m, _with_torque),
    "SIH_T_MAX": _propulsion(lambda propulsion: propulsion.thrust_max_n, _with_thrust),
    "SIH_T_TAU": Figure(_lag_s, _with_lag),
}
