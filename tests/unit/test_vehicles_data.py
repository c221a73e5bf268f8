import json
import math
import re
import shutil
from pathlib import Path

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.run.autopilot_command import AirframeError, read_airframe
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.vehicles import VehicleError, inertia
from sitl_emu.vehicles.battery import LoadBattery
from sitl_emu.vehicles.inertia import Cuboid
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.simulator_parameters import set_parameter
from tests.typed import present

MODELS = ["iris", "m600", "responder", "rover", "sihsim_hex", "sihsim_rover_ackermann"]


def test_models_and_unknown_model() -> None:
    assert vehicles.models() == MODELS
    with pytest.raises(vehicles.UnknownModel) as caught:
        vehicles.load("zeppelin")
    assert (
        str(caught.value)
        == f"unknown vehicle model 'zeppelin'; there are: {', '.join(MODELS)}, or the path of a folder of your own"
    )
    assert caught.value.models == tuple(MODELS)


@pytest.mark.parametrize("model", MODELS)
def test_airframe_is_known_to_the_autopilot(model: str) -> None:
    airframe = vehicles.load(model).airframe
    parameters = Parameters(VehicleKind.of_mav_type(airframe["MAV_TYPE"]), airframe)
    assert parameters["BAT1_N_CELLS"] == vehicles.load(model).battery.cells


@pytest.mark.parametrize("model", ["sihsim_hex", "sihsim_rover_ackermann"])
def test_the_reference_vehicles_begin_where_px4_has_them_begin(model: str) -> None:
    """sih_params.yaml has 47.397742: the facts' seven digits tell 47.39774."""
    airframe = vehicles.load(model).airframe
    parameters = Parameters(VehicleKind.of_mav_type(airframe["MAV_TYPE"]), airframe)
    assert parameters["SIH_LOC_LAT0"] == pytest.approx(47.397742, abs=1.9e-6)


@pytest.mark.parametrize("model", ["iris", "m600", "responder", "sihsim_hex"])
def test_airframe_and_rotors_tell_the_same_geometry(model: str) -> None:
    vehicle = vehicles.load(model)
    parameters = Parameters(VehicleKind.MULTICOPTER, vehicle.airframe)
    rotors = present(vehicle.propulsion).rotors
    assert parameters["CA_ROTOR_COUNT"] == len(rotors)
    assert parameters["THR_MDL_FAC"] == 1.0, "thrust grows with the square of the control"
    scale = None
    for i, rotor in enumerate(rotors):
        assert parameters[f"PWM_MAIN_FUNC{i + 1}"] == 101 + i
        x, y, km = (parameters[f"CA_ROTOR{i}_{axis}"] for axis in ("PX", "PY", "KM"))
        assert (km > 0) == (rotor.turns == "ccw")
        # SIH's geometry is in units of the arm, so only the direction counts
        length, true = (x * x + y * y) ** 0.5, (rotor.position_m[0] ** 2 + rotor.position_m[1] ** 2) ** 0.5
        scale = scale or length / true
        assert x == pytest.approx(scale * rotor.position_m[0], abs=0.01 * scale)
        assert y == pytest.approx(scale * rotor.position_m[1], abs=0.01 * scale)


@pytest.mark.parametrize("model", ["iris", "m600", "responder"])
def test_hover_thrust_parameter_is_the_vehicles(model: str) -> None:
    vehicle = vehicles.load(model)
    propulsion = present(vehicle.propulsion)
    hover = vehicle.mass_kg * 9.80665 / (propulsion.thrust_max_n * len(propulsion.rotors))
    assert vehicle.airframe["MPC_THR_HOVER"] == pytest.approx(hover, abs=0.02)


def test_m600_is_djis() -> None:
    m600 = vehicles.load("m600")
    assert m600.mass_kg == pytest.approx(9.6 + 0.8, abs=0.01)
    propulsion = present(m600.propulsion)
    arm = propulsion.rotors[1].position_m[1]
    assert 2 * arm == pytest.approx(1.133)
    hover_u3 = (9.6 * 9.80665 / 300.0) ** 1.5
    power = 6 * hover_u3 * propulsion.power_max_w
    assert 6 * 129.96 / power * 60.0 == pytest.approx(40.0, abs=1.0), "minutes of hover without payload"
    assert m600.battery.capacity_ah * 22.8 == pytest.approx(6 * 129.96, rel=0.01)


@pytest.mark.parametrize(("figures", "minutes", "lifts"), [(None, 25.8, 3.35), ({}, 14.7, 2.29)])
def test_responder_flies_as_long_and_lifts_as_much_as_the_papers(
    figures: dict[str, float] | None, minutes: float, lifts: float
) -> None:
    """Table 1: 25 min without a parcel, 2 kg. The figures are those of tools/measure_vehicle.py, which flies it."""
    vehicle = vehicles.load("responder")
    if figures is not None:
        vehicle = vehicles.with_parcel(vehicle, figures)
    propulsion, battery = present(vehicle.propulsion), LoadBattery(vehicle.battery)
    weight_n, most_n = inertia.laden(vehicle).mass_kg * 9.80665, 4 * propulsion.thrust_max_n
    seconds = 0.0
    while battery.remaining > 0.07:  # BAT_CRIT_THR
        battery.step(0.2, 4 * propulsion.power_max_w * (weight_n / most_n) ** 1.5, True)
        seconds += 0.2
    assert seconds / 60.0 == pytest.approx(minutes, abs=0.6)
    simulator = VehicleSimulator(vehicle, Home(47.4, 8.5, 489.0, 0.0), 1, FlatGround())
    for _ in range(500):
        simulator.tick(HilActuatorControls(0, 1, (1.0,) * 4, 128))
    thrust_n = propulsion.thrust_max_n * sum(speed**2 for speed in simulator.dynamics.motor_speeds())
    assert thrust_n / weight_n == pytest.approx(lifts, abs=0.05)
    assert lifts >= 1.6


def test_rover_fits_between_rows() -> None:
    chassis = present(vehicles.load("rover").chassis)
    assert chassis.track_m < 0.75
    airframe = vehicles.load("rover").airframe
    assert airframe["RA_WHEEL_BASE"] == chassis.wheelbase_m
    assert airframe["RA_MAX_STR_ANG"] == pytest.approx(chassis.max_steer_angle_rad)


def test_cuboid_and_parallel_axis() -> None:
    # the paper's formula, by hand: m = 12 so that m/12 is 1
    assert inertia.cuboid(12.0, (1.0, 2.0, 3.0)) == (9.0 + 4.0, 1.0 + 9.0, 1.0 + 4.0)
    assert inertia.parallel_axis((1.0, 1.0, 1.0), 2.0, (1.0, 2.0, 3.0)) == (27.0, 21.0, 11.0)


def test_total_of_two_halves_is_the_whole() -> None:
    halves = [Cuboid(3.0, (1.0, 0.5, 0.2), (x, 0.0, 1.0)) for x in (-0.5, 0.5)]
    whole = inertia.total(halves)
    assert whole.mass_kg == 6.0
    assert whole.centre_m == (0.0, 0.0, 1.0)
    assert whole.inertia_kg_m2 == pytest.approx(inertia.cuboid(6.0, (2.0, 0.5, 0.2)))


def test_total_refuses_what_is_not_symmetric() -> None:
    with pytest.raises(ValueError, match="not symmetric"):
        inertia.total([Cuboid(1.0, (0.1, 0.1, 0.1), (1.0, 1.0, 0.0)), Cuboid(1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))])
    with pytest.raises(ValueError, match="at least one part"):
        inertia.total([])


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    copy = tmp_path / "mine"
    shutil.copytree(Path(vehicles.__file__).parent / "iris", copy)
    return copy


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        (
            "mass_kg = 1.535",
            "mass_kg = -1.0",
            "mine/vehicle.toml: mass_kg = -1.0 is out of range; allowed is 0.001 or more",
        ),
        ("mass_kg = 1.535", "mass_kg = inf", "mass_kg = inf is out of range; allowed is 0.001 or more"),
        ("mass_kg = 1.535", f"mass_kg = 1{400 * '0'}", "mass_kg = 10+ is out of range; allowed is 0.001 or more"),
        ("mass_kg = 1.535", f"mass_kg = 1{5000 * '0'}", "mine/vehicle.toml: "),
        ("mass_kg = 1.535", "mass_lb = 3", r"unknown field 'mass_lb' = 3; allowed are: description,"),
        ("mass_kg = 1.535", "", "mass_kg and inertia_kg_m2 are needed, or parts"),
        ("cells = 4", "cells = 4.5", r"battery: cells = 4.5 must be a whole number"),
        ("cells = 4", "cells = true", r"battery: cells = True must be a whole number"),
        ('kind = "load"', 'kind = "fuel"', r"battery: kind = 'fuel'; allowed are: load, px4"),
        ('turns = "ccw"', 'turns = "left"', r"rotors\[0\]: turns = 'left'; allowed are: ccw, cw"),
        ("[0.029125, 0.029125, 0.055225]", "[0.029125, 0.055225]", r"must have 3 elements"),
        ("[0.029125, 0.029125, 0.055225]", '["a", 1, 1]', r"inertia_kg_m2\[0\] = 'a' must be a number"),
        ("[0.029125, 0.029125, 0.055225]", "[0, 0, 0]", r"inertia_kg_m2\[0\] = 0 is out of range; allowed is 1e-09 or"),
        ("thrust_max_n = 7.07", "thrust_max_n = inf", "thrust_max_n = inf is out of range; allowed is 0.01 or more"),
        (
            "[0.1515, 0.2450, 0.0]",
            "[inf, 0.2450, 0.0]",
            r"position_m\[0\] = inf is out of range; allowed is any finite",
        ),
        ("cell_empty_v = 3.5", "cell_empty_v = 4.2", "battery: cell_empty_v = 4.2 must be below cell_full_v"),
        ("min_distance_m = 0.2", "min_distance_m = 60.0", "lidar: min_distance_m = 60.0 must be below max_distance_m"),
        ("[gear]", "[skids]", "unknown field 'skids'"),
        ("thrust_max_n = 7.07", "", "propulsion: the field 'thrust_max_n' is missing"),
        ("[battery]", "[battery", "/mine/vehicle.toml: "),
        (
            "cells = 4",
            f"cells = {9999 * '['}",
            "/mine/vehicle.toml: nested too deeply; a vehicle",
        ),
    ],
)
def test_wrong_fields_are_named(folder: Path, old: str, new: str, error: str) -> None:
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    assert old in text
    toml.write_text(text.replace(old, new, 1))
    with pytest.raises(VehicleError, match=error):
        vehicles.read(folder)


def test_a_vehicle_needs_a_rotor_and_parts_with_sizes(folder: Path) -> None:
    toml = folder / "vehicle.toml"
    text = toml.read_text()
    toml.write_text(re.sub(r"rotors = \[.*?^\]", "rotors = []", text, flags=re.DOTALL | re.MULTILINE))
    with pytest.raises(VehicleError, match=r"mine/vehicle.toml: propulsion: rotors = \[\]; at least one is needed"):
        vehicles.read(folder)
    part = 'parts = [{ name = "all", mass_kg = 1.5, size_m = [0, 0, 0] }]'
    toml.write_text(text.replace("mass_kg = 1.535", part, 1).replace("inertia_kg_m2", "#", 1))
    with pytest.raises(VehicleError, match=r"parts: their inertia is \(0.0, 0.0, 0.0\) kg m²; give them sizes"):
        vehicles.read(folder)


def test_what_nothing_breaks_may_stay_so(folder: Path) -> None:
    toml = folder / "vehicle.toml"
    toml.write_text(toml.read_text().replace("crash_speed_m_s = 4.0", "crash_speed_m_s = inf", 1))
    assert present(vehicles.read(folder).gear).crash_speed_m_s == math.inf


def test_a_scenarios_lidar_must_see_farther_than_near() -> None:
    with pytest.raises(VehicleError, match=r"sensors: lidar: min_distance_m = 20.0 must be below max_distance_m"):
        vehicles.with_sensors(vehicles.load("iris"), {"lidar": {"min_distance_m": 20}})


def test_wrong_airframe_is_named(folder: Path) -> None:
    (folder / "airframe.json").write_text(json.dumps({"MAV_TYPE": "quad"}))
    with pytest.raises(VehicleError, match=r"mine/airframe.json: MAV_TYPE = 'quad' must be a number"):
        vehicles.read(folder)
    (folder / "airframe.json").unlink()
    with pytest.raises(VehicleError, match=r"mine/airframe\.json"):
        vehicles.read(folder)


@pytest.mark.parametrize(
    ("value", "told"), [("NaN", "nan"), ("-Infinity", "-inf"), ("1e39", r"1e\+39"), ("1" * 400, "1+")]
)
def test_an_airframes_numbers_are_finite(folder: Path, value: str, told: str) -> None:
    file = folder / "airframe.json"
    file.write_text(f'{{"MPC_XY_P": {value}}}')
    with pytest.raises(VehicleError, match=f"mine/airframe.json: MPC_XY_P = {told} must be a finite number"):
        vehicles.read(folder)
    with pytest.raises(AirframeError, match=f"airframe.json: MPC_XY_P: {told}; allowed: a finite number"):
        read_airframe(file)


def test_satellites_are_what_the_simulator_begins_with() -> None:
    for model in vehicles.models():
        vehicle = vehicles.load(model)
        assert vehicle.airframe["SIM_GPS_USED"] == vehicle.sensors.gps.satellites
    iris = vehicles.load("iris")
    parameters = Parameters(VehicleKind.MULTICOPTER, iris.airframe)
    simulator = VehicleSimulator(iris, Home(47.0, 8.0, 488.0, 0.0), 1, FlatGround())
    for parameter in SimulatedParameters(parameters).changed():
        set_parameter(simulator, *parameter)
    assert simulator.sim_gps_used == 16
    parameters.set("SIM_GPS_USED", 7)
    assert int(parameters["SIM_GPS_USED"]) == 7
