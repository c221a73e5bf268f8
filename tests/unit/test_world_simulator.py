import math

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.core.simulator_api import (
    FIELDS_UPDATED_BARO,
    FIELDS_UPDATED_MAG,
    SIMULATOR_PARAMETERS,
    DistanceSensor,
    EscTelemetry,
    HilActuatorControls,
    HilGps,
    HilSensor,
    HilStateQuaternion,
    RangingBeacon,
    SimulatedBattery,
    SimulatorMessage,
    SimulatorParameter,
    as_on_the_wire,
)
from sitl_emu.run.simulated_parameters import SimulatedParameters
from sitl_emu.vehicles.battery import LoadBattery, Px4Battery
from sitl_emu.vehicles.multicopter import Multicopter
from sitl_emu.world.ground import FlatGround, Terrain
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import Home, VehicleSimulator
from sitl_emu.world.simulator_parameters import set_parameter
from sitl_emu.world.wind import Wind

HOME = Home(40.47, -86.99, 215.0, 60.0)
HILL = type("Hill", (), {"height_m": lambda self, north, east: 1.5 + 0.1 * north})()


def simulate(
    model: str,
    ticks: int,
    controls: HilActuatorControls | None = None,
    seed: int = 1,
    name: str = "uas",
    terrain: Terrain | None = None,
    wind: Wind | None = None,
    start_north_m: float = 0.0,
    start_east_m: float = 0.0,
) -> tuple[VehicleSimulator, list[SimulatorMessage]]:
    simulator = VehicleSimulator(
        vehicles.load(model), HOME, seed, terrain or FlatGround(), wind, start_north_m, start_east_m, name
    )
    messages = [message for _ in range(ticks) for message in simulator.tick(controls)]
    return simulator, messages


def count(messages: list[SimulatorMessage], kind: type[SimulatorMessage]) -> int:
    return sum(isinstance(message, kind) for message in messages)


def test_rates() -> None:
    _, messages = simulate("m600", 2500)
    assert count(messages, HilSensor) == 2500
    assert count(messages, HilGps) == 81
    assert count(messages, DistanceSensor) == 201
    assert count(messages, SimulatedBattery) == 51
    assert count(messages, HilStateQuaternion) == 1251
    sensors = [message for message in messages if isinstance(message, HilSensor)]
    assert sum(sensor.fields_updated & FIELDS_UPDATED_MAG != 0 for sensor in sensors) == pytest.approx(150, abs=2)
    assert sum(sensor.fields_updated & FIELDS_UPDATED_BARO != 0 for sensor in sensors) == pytest.approx(250, abs=2)
    assert [sensor.time_usec for sensor in sensors] == [4000 * (tick + 1) for tick in range(2500)]


def test_every_tick_ends_with_hil_sensor() -> None:
    simulator, _ = simulate("iris", 0)
    for _ in range(100):
        *before, last = simulator.tick(None)
        assert isinstance(last, HilSensor)
        assert not any(isinstance(message, HilSensor) for message in before)


@pytest.mark.parametrize("model", vehicles.models())
def test_records_fit_on_the_wire(model: str) -> None:
    controls = HilActuatorControls(0, 1, (0.9,) * 6, 128)
    _, messages = simulate(model, 200, controls)
    for message in messages:
        on_the_wire = as_on_the_wire(message)
        for mine, its in zip(message, on_the_wire, strict=True):
            if isinstance(mine, int):
                assert mine == its


def test_same_arguments_same_run_and_other_seeds_other_noise() -> None:
    controls = HilActuatorControls(0, 1, (0.7,) * 6, 128)
    gusts = [Wind(2.0, 1.0, 0.5, seed=1) for _ in range(3)]
    one = simulate("m600", 600, controls, wind=gusts[0])[1]
    assert one == simulate("m600", 600, controls, wind=gusts[1])[1]
    assert one != simulate("m600", 600, controls, seed=2, wind=gusts[2])[1]
    assert simulate("iris", 10)[1] != simulate("iris", 10, name="other")[1]


def test_stands_at_its_place_with_its_heading() -> None:
    simulator, _ = simulate("m600", 100, terrain=HILL, start_north_m=20.0, start_east_m=-5.0)
    pose = simulator.pose()
    assert (pose.north_m, pose.east_m) == pytest.approx((20.0, -5.0), abs=1e-3)
    assert pose.alt_amsl_m == pytest.approx(215.0 + 3.5 + 0.42, abs=0.02)
    w, x, y, z = pose.q
    assert math.degrees(math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))) == pytest.approx(60.0, abs=0.5)
    assert pose.lat_deg == pytest.approx(40.47 + math.degrees(20.0 / 6371000.0))
    assert pose.time_usec == 400_000


def test_lidar_on_the_ground_reads_the_gear() -> None:
    _, messages = simulate("m600", 500, terrain=HILL)
    heights = [message.current_distance for message in messages if isinstance(message, DistanceSensor)]
    assert sum(heights) / len(heights) == pytest.approx(41.5, abs=2.0)


def test_failures() -> None:
    simulator, _ = simulate("m600", 10)
    simulator.gps_off = simulator.baro_off = simulator.mag_off = simulator.lidar_off = True
    messages = [message for _ in range(500) for message in simulator.tick(None)]
    assert count(messages, HilGps) == count(messages, DistanceSensor) == 0
    assert not any(
        m.fields_updated & (FIELDS_UPDATED_BARO | FIELDS_UPDATED_MAG) for m in messages if isinstance(m, HilSensor)
    )
    simulator.gps_off = False
    simulator.sim_gps_used = 2
    messages = [message for _ in range(100) for message in simulator.tick(None)]
    assert {message.fix_type for message in messages if isinstance(message, HilGps)} == {0}
    simulator.motor_off[0] = True
    simulator.tick(HilActuatorControls(0, 1, (1.0,) * 6, 128))
    assert isinstance(simulator.dynamics, Multicopter)
    assert simulator.dynamics.motor_speeds()[0] == 0.0 < simulator.dynamics.motor_speeds()[1]


def test_sih_wind_follows_px4s_sign() -> None:
    """PX4 v1.18 with SIH_WIND_N -4 leans 21 degrees nose up, against air that moves north."""
    simulator, _ = simulate("sihsim_hex", 1)
    simulator.sih_wind_n = -4.0
    u = math.sqrt(9.81 / 30.0) * 1.01
    for _ in range(500):
        simulator.tick(HilActuatorControls(0, 1, (u,) * 6, 128))
    assert simulator.pose().vn_m_s > 1.0


def test_reference_vehicles_do_not_know_the_worlds_wind() -> None:
    u = math.sqrt(9.81 / 30.0) * 1.01
    controls = HilActuatorControls(0, 1, (u,) * 6, 128)
    simulator, _ = simulate("sihsim_hex", 500, controls, wind=Wind(5.0, 0.0))
    assert simulator.pose().vn_m_s == pytest.approx(0.0, abs=1e-6)


def test_px4s_battery_parameters_reach_the_battery() -> None:
    simulator, _ = simulate("sihsim_hex", 1)
    simulator.sim_bat_drain, simulator.sim_bat_min_pct = 10.0, 20.0
    controls = HilActuatorControls(0, 1, (0.1,) * 6, 128)
    messages = [message for _ in range(3000) for message in simulator.tick(controls)]
    levels = [each.state_of_charge for each in messages if isinstance(each, SimulatedBattery)]
    assert levels[24] == pytest.approx(50, abs=3)
    assert levels[24] - levels[25] == pytest.approx(2.0, abs=0.01), "0.2 s of 10"
    assert levels[-1] == pytest.approx(20)
    other, _ = simulate("iris", 1)
    other.sim_bat_drain = 1.0
    assert math.isnan(other.sim_bat_drain)


def test_flying_drains_the_battery_as_djis_hover_time_says() -> None:
    simulator, _ = simulate("m600", 1)
    hover = math.sqrt(10.4 * 9.8 / 300.0)
    for _ in range(15000):  # whoever hovers gives the more the lower the voltage is
        simulator.tick(HilActuatorControls(0, 1, (hover / simulator.dynamics.drive,) * 6, 128))
    power = simulator.dynamics.power_w + 25.0
    assert 6 * 129.96 / power * 60.0 == pytest.approx(35.0, abs=1.5), "minutes with 0.8 kg of payload, 40 without"
    used_wh = (1.0 - simulator.battery.remaining) * 34.2 * simulator.battery.voltage_v
    assert used_wh == pytest.approx(power / 60.0, rel=0.03)


def test_sih_rover_coasts_when_disarmed_as_px4s_does() -> None:
    """A disarmed PX4 writes no outputs, and SIH goes on with the last ones."""
    simulator, _ = simulate("sihsim_rover_ackermann", 1)
    for _ in range(1000):
        simulator.tick(HilActuatorControls(0, 1, (0.0, 0.5), 128))
    before = simulator.dynamics.vn_m_s, simulator.dynamics.ve_m_s
    for _ in range(500):
        simulator.tick(HilActuatorControls(0, 1, (0.0, 0.0), 0))
    assert (simulator.dynamics.vn_m_s, simulator.dynamics.ve_m_s) == pytest.approx(before, abs=0.05)
    for _ in range(500):
        simulator.tick(HilActuatorControls(0, 1, (0.0, 0.0), 128))
    assert math.hypot(simulator.dynamics.vn_m_s, simulator.dynamics.ve_m_s) < 0.05


def test_sih_rover_says_nothing_of_its_motor_before_it_is_armed() -> None:
    """The disarmed outputs at boot are none to PX4's SIH (fact stream/gcs/disarmed/message_names of the rover)."""
    simulator, _ = simulate("sihsim_rover_ackermann", 1)
    for armed in (0, 128):
        told = 0
        for _ in range(100):
            controls = HilActuatorControls(simulator.time_usec, 1, (0.0, 0.5), armed)
            told += count(simulator.tick(controls), EscTelemetry)
        assert bool(told) == bool(armed)


def test_truth_message() -> None:
    simulator, _ = simulate("m600", 50, HilActuatorControls(0, 1, (0.9,) * 6, 128))
    truth, pose = simulator.truth(), simulator.pose()
    assert truth.lat * 1e-7 == pytest.approx(pose.lat_deg, abs=1e-7)
    assert truth.vz == pytest.approx(pose.vd_m_s * 100, abs=0.5)
    assert as_on_the_wire(truth) == truth
    assert truth.attitude_quaternion == pytest.approx(pose.q, abs=1e-6)


def test_px4s_sensor_offsets_reach_the_sensors() -> None:
    """SIM_BARO_OFF_P in Pa, SIM_BARO_OFF_T in degrees, SIM_MAG_OFFSET_* in gauss, as PX4's sensor_*_sim add them."""
    reads = []
    for offsets in ({}, {"SIM_BARO_OFF_P": 120.0, "SIM_BARO_OFF_T": 10.0, "SIM_MAG_OFFSET_Y": 0.25}):
        simulator = VehicleSimulator(vehicles.load("sihsim_hex"), HOME, 1, FlatGround(), name="uas")
        for parameter in SimulatedParameters(Parameters(VehicleKind.MULTICOPTER, offsets)).changed():
            set_parameter(simulator, *parameter)
        messages = [message for _ in range(50) for message in simulator.tick(None)]
        reads.append([message for message in messages if isinstance(message, HilSensor)][-1])
    plain, off = reads
    assert off.abs_pressure - plain.abs_pressure == pytest.approx(1.2, abs=1e-3)
    assert off.temperature - plain.temperature == pytest.approx(10.0)
    assert (off.xmag - plain.xmag, off.ymag - plain.ymag) == pytest.approx((0.0, 0.25), abs=1e-6)


def test_the_lidar_says_what_sih_distsnsr_ovr_says_or_nothing() -> None:
    for told, seen in ((-1.0, {0}), (7.25, {725}), (20_000.0, set())):
        simulator = VehicleSimulator(vehicles.load("sihsim_hex"), HOME, 1, FlatGround(), name="uas")
        set_parameter(simulator, "SIH_DISTSNSR_OVR", told)
        messages = [message for _ in range(50) for message in simulator.tick(None)]
        assert {message.current_distance for message in messages if isinstance(message, DistanceSensor)} == seen


def test_the_lidar_of_sih_reaches_as_far_as_its_parameters_say() -> None:
    """Sih::parameters_updated; no farther than the message can tell."""
    for told_m, seen_cm in ((20.0, 2_000), (1_000.0, 32_766)):
        simulator = VehicleSimulator(vehicles.load("sihsim_hex"), HOME, 1, FlatGround(), name="uas")
        set_parameter(simulator, "SIH_DISTSNSR_MIN", 0.5)
        set_parameter(simulator, "SIH_DISTSNSR_MAX", told_m)
        ranges = [message for message in simulator.tick(None) if isinstance(message, DistanceSensor)]
        assert (ranges[0].min_distance, ranges[0].max_distance) == (50, seen_cm)


@pytest.mark.parametrize("model", ["sihsim_hex", "sihsim_rover_ackermann"])
def test_by_their_defaults_the_vehicles_of_sih_are_what_their_pages_say(model: str) -> None:
    vehicle = vehicles.load(model)
    simulator = VehicleSimulator(vehicle, HOME, 1, FlatGround(), name="uas")
    parameters = Parameters(VehicleKind.of_mav_type(vehicle.airframe["MAV_TYPE"]), vehicle.airframe)
    for parameter in SimulatedParameters(parameters).changed():
        set_parameter(simulator, *parameter)
    assert simulator.vehicle is vehicle


def test_what_sih_s_hexacopter_weighs_and_lifts_can_be_changed_while_it_flies() -> None:
    """2 kg under six rotors of 8 N; a vehicle that is not SIH's takes no notice."""
    full = HilActuatorControls(0, 1, (1.0,) * 6, 128)
    simulator, _ = simulate("sihsim_hex", 250, full)
    for name, value in {"SIH_MASS": 2.0, "SIH_T_MAX": 8.0, "SIH_KDV": 0.0, "SIH_T_TAU": 0.1}.items():
        set_parameter(simulator, name, value)
    for _ in range(2):
        simulator.tick(full)
    assert simulator.dynamics.az_m_s2 == pytest.approx(-48.0 / 2.0, rel=0.01)
    set_parameter(simulator, "SIH_MASS", 0.0)
    simulator.tick(full)
    assert simulator.dynamics.az_m_s2 == pytest.approx(-48.0 / 2.0, rel=0.01)
    iris, _ = simulate("iris", 0)
    set_parameter(iris, "SIH_MASS", 9.0)
    assert iris.vehicle.mass_kg == vehicles.load("iris").mass_kg


def test_wider_arms_turn_sih_s_hexacopter_the_more() -> None:
    rolls, rates = HilActuatorControls(0, 1, (0.5, 0.5, 0.5, 0.6, 0.6, 0.6), 128), []
    for arm_m, inertia in ((0.2, 0.025), (0.4, 0.025), (0.2, 0.05)):
        simulator, _ = simulate("sihsim_hex", 0)
        set_parameter(simulator, "SIH_L_ROLL", arm_m)
        set_parameter(simulator, "SIH_IXX", inertia)
        simulator.tick(rolls)
        rates.append(simulator.dynamics.p_rad_s)
    assert rates[0] > 0.0 and rates[1:] == pytest.approx([2.0 * rates[0], 0.5 * rates[0]], rel=0.01)


def test_without_sih_rngbc_noise_the_beacons_are_exact() -> None:
    simulator = VehicleSimulator(vehicles.load("sihsim_hex"), HOME, 1, FlatGround(), name="uas")
    set_parameter(simulator, "SIH_RNGBC_NOISE", 0.0)
    messages = [message for _ in range(130) for message in simulator.tick(None)]
    told = [message.range for message in messages if isinstance(message, RangingBeacon)]
    assert told == [pytest.approx(1e3 * math.hypot(5_000.0, 30.0), abs=100.0)]


def test_px4s_battery_has_the_cells_that_the_parameters_say() -> None:
    """Six cells of 4.2 V in place of the airframe's four of 4.05 V; a battery that its load drains has its own."""
    told = {"BAT1_N_CELLS": 6.0, "BAT1_V_CHARGED": 4.2}
    volts = []
    for model in ("sihsim_hex", "iris"):
        simulator = VehicleSimulator(vehicles.load(model), HOME, 1, FlatGround(), name="uas")
        for parameter in SimulatedParameters(Parameters(VehicleKind.MULTICOPTER, told)).changed():
            set_parameter(simulator, *parameter)
        messages = simulator.tick(None)
        volts.append(next(message.voltage for message in messages if isinstance(message, SimulatedBattery)))
    assert volts[0] == pytest.approx(25.2) and 16.0 < volts[1] < 17.0


def test_vehicles_of_one_simulation_fly_as_each_would_alone_under_its_own_controls() -> None:
    """They stand apart and have nothing to do with one another."""
    climb = HilActuatorControls(0, 1, (0.8,) * 4, 128)
    simulation = Simulation([simulate("iris", 0, name="one")[0], simulate("iris", 0, name="two", start_east_m=3.0)[0]])
    sensed = [simulation.tick([climb, None]) for _ in range(100)]
    alone, flown = simulate("iris", 100, climb, name="one")
    stays, stood = simulate("iris", 100, None, name="two", start_east_m=3.0)
    assert [message for one, _ in sensed for message in one] == flown
    assert [message for _, two in sensed for message in two] == stood
    assert [simulator.pose() for simulator in simulation.simulators] == [alone.pose(), stays.pose()]


def test_every_parameter_that_autopilots_tell_is_heeded_and_others_are_passed_over() -> None:
    """None but `SIMULATOR_PARAMETERS` does anything, and each of them does."""
    for name in SIMULATOR_PARAMETERS:
        simulator, _ = simulate("sihsim_hex", 0)
        before = seen(simulator)
        set_parameter(simulator, "SIM_AGP_FAIL", 3.0)
        assert seen(simulator) == before
        set_parameter(simulator, name, 3.0)
        assert seen(simulator) != before, name


def seen(simulator: VehicleSimulator) -> list[object]:
    barometer = simulator.barometer
    air = [simulator.sih_wind_n, simulator.sih_wind_e, barometer.offset_pa, barometer.temperature_offset_c]
    ranges = [simulator.sih_distsnsr_ovr, simulator.sih_rngbc_noise]
    battery = [simulator.sim_bat_drain, simulator.sim_bat_min_pct]
    if isinstance(cells := simulator.battery, Px4Battery):
        battery += [cells.bat1_n_cells, cells.bat1_v_empty, cells.bat1_v_charged]
    return [simulator.vehicle, *air, *ranges, *battery, simulator.sim_gps_used, simulator.magnetometer.offset_gauss]


def test_parameters_about_the_simulator_are_told_at_first_and_whenever_they_change() -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER, {"SIM_GPS_USED": 12})
    simulated = SimulatedParameters(parameters)
    assert dict(simulated.changed()).keys() == set(SIMULATOR_PARAMETERS)
    assert simulated.changed() == ()
    parameters.set("MPC_XY_P", 0.5)
    assert not simulated.changed()
    parameters.set("SIM_GPS_USED", 3)
    assert simulated.changed() == [SimulatorParameter("SIM_GPS_USED", 3.0)]


def test_thrust_falls_with_the_voltage_and_ends_with_the_charge() -> None:
    climb = HilActuatorControls(0, 1, (0.8,) * 4, 128)
    fresh, _ = simulate("iris", 250, climb)
    worn = simulate("iris", 0)[0]
    assert isinstance(worn.battery, LoadBattery)
    worn.battery.remaining = 0.15
    for _ in range(250):
        worn.tick(climb)
    assert 0.75 < worn.dynamics.motor_speeds()[0] / fresh.dynamics.motor_speeds()[0] < 0.95
    assert -worn.pose().down_m < -fresh.pose().down_m - 0.5
    worn.battery.remaining = 0.0
    for _ in range(250):
        worn.tick(climb)
    assert max(worn.dynamics.motor_speeds()) < 0.01
