import itertools
import math
import statistics

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.core.attitude import quaternion
from sitl_emu.core.geodesy import MapProjection
from sitl_emu.core.geomagnetism import MagneticField
from sitl_emu.vehicles.description import Gps as GpsData
from sitl_emu.world.atmosphere import gravity_m_s2, pressure_altitude_m, pressure_hpa
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.noise import GaussMarkov, generator, normals
from sitl_emu.world.sensors.barometer import Barometer
from sitl_emu.world.sensors.gps import Gps
from sitl_emu.world.sensors.imu import Imu
from sitl_emu.world.sensors.lidar import Lidar, beam
from sitl_emu.world.sensors.magnetometer import Magnetometer
from tests.typed import present

IRIS, M600 = vehicles.load("iris").sensors, vehicles.load("m600").sensors
LEVEL = (1.0, 0.0, 0.0, 0.0)


def gps_errors(seed: int, name: str, minutes: float = 60, data: GpsData = IRIS.gps) -> list[tuple[float, float, float]]:
    projection = MapProjection(40.47, -86.99)
    gps, fixes = Gps(data, projection, 215.0, seed, name), []
    for tick in range(round(minutes * 60 * data.rate_hz)):
        fix = gps.read(round(tick * 1e6 / data.rate_hz), 10.0, -20.0, -15.0, 1.0, 0.0, 0.0)
        north, east = projection.project(fix.lat * 1e-7, fix.lon * 1e-7)
        fixes.append((north - 10.0, east + 20.0, 230.0 - fix.alt * 1e-3))
    return fixes


def test_gps_is_half_a_metre_off_in_all() -> None:
    squares = [north**2 + east**2 for seed in range(12) for north, east, _ in gps_errors(seed, "uas", 10)]
    assert math.sqrt(statistics.fmean(squares)) == pytest.approx(0.5, abs=0.1)


def test_gps_error_is_mostly_slow() -> None:
    errors = gps_errors(3, "uas", 30)
    steps = [later[0] - earlier[0] for earlier, later in itertools.pairwise(errors)]
    assert statistics.pstdev(steps) < 0.16
    assert statistics.pstdev([error[0] for error in errors]) > 0.2


def test_gps_drift_is_each_vehicles_own() -> None:
    a, b = gps_errors(3, "uas", 20), gps_errors(3, "ugv", 20)
    assert a != b
    apart = [(one[0] - two[0]) ** 2 + (one[1] - two[1]) ** 2 for one, two in zip(a, b, strict=True)]
    assert math.sqrt(statistics.fmean(apart)) > 0.3
    assert a == gps_errors(3, "uas", 20), "same seed, same errors"


def test_gps_says_what_it_knows() -> None:
    gps = Gps(IRIS.gps, MapProjection(40.47, -86.99), 215.0, 1, "uas")
    fix = gps.read(125_000, 0.0, 0.0, 0.0, 3.0, -3.0, 1.0)
    assert (fix.fix_type, fix.satellites_visible, fix.eph, fix.epv) == (3, 16, 60, 100)
    assert fix.vel == pytest.approx(424, abs=30)
    assert fix.cog == pytest.approx(31500, abs=500)
    gps.satellites = 0
    lost = gps.read(250_000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert (lost.fix_type, lost.satellites_visible) == (0, 0)
    assert lost.eph > 5000


def test_imu_noise_and_bias() -> None:
    still, running = [], []
    imu = Imu(M600.imu, 1, "uas")
    for _ in range(3000):
        still.append(imu.read(0.0, 0.0, -9.8, 0.0, 0.0, 0.0, LEVEL, False))
        running.append(imu.read(0.0, 0.0, -9.8, 0.0, 0.0, 0.0, LEVEL, True))
    for axis in range(6):
        data = M600.imu.accel_noise_still_m_s2 + M600.imu.gyro_noise_still_rad_s
        assert statistics.pstdev(sample[axis] for sample in still) == pytest.approx(data[axis], rel=0.1)
        data = M600.imu.accel_noise_m_s2 + M600.imu.gyro_noise_rad_s
        assert statistics.pstdev(sample[axis] for sample in running) == pytest.approx(data[axis], rel=0.1)
    biases = [Imu(M600.imu, seed, "uas")._accel_bias[0] for seed in range(200)]
    assert statistics.pstdev(biases) == pytest.approx(M600.imu.accel_bias_m_s2, rel=0.2)


@pytest.mark.parametrize("yaw_deg", [0, 90, 200])
def test_magnetometer_points_to_magnetic_north(yaw_deg: float) -> None:
    field = MagneticField(math.radians(-4.8), math.radians(67.5), 0.52)
    magnetometer = Magnetometer(M600.magnetometer, field, 1, "uas")
    attitude = quaternion(0.0, 0.0, math.radians(yaw_deg))
    readings = [magnetometer.read(attitude) for _ in range(400)]
    x, y, z = (statistics.fmean(reading[axis] for reading in readings) for axis in range(3))
    heading = math.degrees(-math.atan2(y, x)) - 4.8
    assert math.remainder(heading - yaw_deg, 360.0) == pytest.approx(0.0, abs=3.0)
    assert math.hypot(x, y, z) == pytest.approx(0.52, abs=0.02)
    assert z == pytest.approx(0.52 * math.sin(math.radians(67.5)), abs=0.02)


def test_magnetometer_keeps_the_field_when_tilted() -> None:
    field = MagneticField(0.1, 1.1, 0.5)
    magnetometer = Magnetometer(vehicles.load("sihsim_hex").sensors.magnetometer, field, 1, "uas")
    magnetometer._noise = (0.0, 0.0, 0.0)
    for euler in ((0.3, -0.2, 1.0), (-1.0, 0.5, -2.0)):
        assert math.hypot(*magnetometer.read(quaternion(*euler))) == pytest.approx(0.5)
    # nose down into the field: the whole of it lies along x
    assert magnetometer.read(quaternion(0.0, -1.1, 0.1)) == pytest.approx((0.5, 0.0, 0.0), abs=1e-9)


def test_standard_atmosphere() -> None:
    assert pressure_hpa(0.0) == 1013.25
    assert pressure_hpa(1000.0) == pytest.approx(898.76, abs=0.02)
    assert pressure_hpa(5000.0) == pytest.approx(540.2, abs=0.1)
    assert pressure_altitude_m(pressure_hpa(489.4)) == pytest.approx(489.4)
    assert gravity_m_s2(45.0) == pytest.approx(9.8062, abs=1e-4)


def test_barometer_noise_is_the_data_sheets() -> None:
    barometer = Barometer(IRIS.barometer, 1, "uas")
    readings = [barometer.read(215.0)[0] for _ in range(2000)]
    steps = [later - earlier for earlier, later in itertools.pairwise(readings)]
    assert statistics.pstdev(steps) / math.sqrt(2) == pytest.approx(0.012, rel=0.1)
    pressure, altitude = barometer.read(230.0)
    assert altitude == pytest.approx(230.0, abs=3.0)
    assert pressure == pytest.approx(pressure_hpa(230.0), abs=0.3)


def test_the_barometer_of_px4s_hexacopter_has_sihs_air() -> None:
    """The measured log of a flight up to 506 m: 11.82 °C on the ground, 11.71 up there, pressures of 955.8 to 953.9."""
    barometer = Barometer(vehicles.load("sihsim_hex").sensors.barometer, 1, "uas")
    for alt_m, celsius, hpa in ((489.4, 11.82, 955.76), (505.7, 11.71, 953.93)):
        pressures = [barometer.read(alt_m)[0] for _ in range(2000)]
        assert barometer.temperature_c == pytest.approx(celsius, abs=0.01)
        assert statistics.fmean(pressures) == pytest.approx(hpa, abs=0.04)
        assert statistics.fmean(map(pressure_altitude_m, pressures)) == pytest.approx(alt_m + 0.3, abs=0.05)


@given(
    st.floats(0.5, 11.0),
    st.floats(-0.4, 0.4),
    st.floats(-0.4, 0.4),
    st.floats(-3.1, 3.1),
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
)
@settings(max_examples=80)
def test_lidar_beam_meets_an_inclined_plane(
    height: float, roll: float, pitch: float, yaw: float, rise_n: float, rise_e: float
) -> None:
    class Plane:
        def height_m(self, north: float, east: float) -> float:
            return 4.0 + rise_n * north + rise_e * east

    north, east = 3.0, -5.0
    down = -(Plane().height_m(north, east) + height)
    attitude = quaternion(roll, pitch, yaw)
    # by hand: the ray's point p + s·d lies on the plane
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    direction = (cr * sp * cy + sr * sy, cr * sp * sy - sr * cy, cr * cp)
    expected = height / (direction[2] + rise_n * direction[0] + rise_e * direction[1])
    assert beam(Plane(), north, east, down, attitude, 50.0) == pytest.approx(expected, abs=0.03)


def test_lidar_reads_in_range_and_says_so_out_of_it() -> None:
    lidar = Lidar(present(M600.lidar), FlatGround(2.0), 1, "uas")
    shots = [lidar.read(tick * 50_000, 0.0, 0.0, -10.0, LEVEL) for tick in range(2000)]
    assert statistics.fmean(shot.current_distance for shot in shots) == pytest.approx(800, abs=0.5)
    assert statistics.pstdev(shot.current_distance for shot in shots) == pytest.approx(5.0, rel=0.1)
    assert {(shot.min_distance, shot.max_distance, shot.orientation) for shot in shots} == {(20, 1200, 25)}
    assert shots[-1].time_boot_ms == 1999 * 50
    for down, attitude in ((-15.0, LEVEL), (-2.05, LEVEL), (-10.0, quaternion(2.0, 0.0, 0.0))):
        blind = lidar.read(0, 0.0, 0.0, down, attitude)
        assert blind.current_distance == blind.max_distance + 1
        assert blind.signal_quality == 1


def test_px4s_own_lidar_says_how_far_below_the_ground_it_is_and_that_this_is_not_valid() -> None:
    """Sih::send_dist_snsr gives a negative distance, streams/DISTANCE_SENSOR.hpp the 16 bits of its centimetres."""
    lidar = Lidar(present(vehicles.load("sihsim_hex").sensors.lidar), FlatGround(), 1, "uas")
    shots = [lidar.read(0, 0.0, 0.0, down_m, LEVEL) for down_m in (-2.0, 0.0, 0.3)]
    assert [(shot.current_distance, shot.signal_quality) for shot in shots] == [(200, 0), (0, 1), (65536 - 30, 1)]
    lidar.override_m = 0.0
    shot = lidar.read(0, 0.0, 0.0, 0.3, LEVEL)
    assert (shot.current_distance, shot.signal_quality) == (0, 0), "SIH_DISTSNSR_OVR is believed"


def test_an_m8n_is_a_word_and_has_its_circle() -> None:
    m8n = vehicles.with_sensors(vehicles.load("responder"), {"gps": "m8n"}).sensors.gps
    away = [math.hypot(north, east) for seed in range(3000) for north, east, _ in gps_errors(seed, "uas", 0.004, m8n)]
    assert statistics.median(away) == pytest.approx(2.5, rel=0.05), "half of the fixes lie within 2.5 m"
    with pytest.raises(vehicles.VehicleError, match=r"sensors: gps = 'm9n': known are m8n, or give its figures"):
        vehicles.with_sensors(vehicles.load("iris"), {"gps": "m9n"})


def test_a_tf_luna_is_as_exact_as_its_data_sheet_says() -> None:
    data = present(vehicles.load("responder").sensors.lidar)
    for range_m, accuracy_m, repeats_m in (
        (1.0, 0.06, 0.005),
        (2.0, 0.06, 0.005),
        (4.0, 0.08, 0.01),
        (7.0, 0.14, 0.0175),
    ):
        wrong = []
        for seed in range(40):
            lidar = Lidar(data, FlatGround(), seed, "uas")
            shots = [lidar.read(tick * 20_000, 0.0, 0.0, -range_m, LEVEL).current_distance for tick in range(200)]
            assert statistics.pstdev(shots) == pytest.approx(math.hypot(100.0 * repeats_m, 0.29), rel=0.25), "cm steps"
            wrong.append(statistics.fmean(shots) / 100.0 - range_m)
        assert max(map(abs, wrong)) < accuracy_m + 0.005
        assert statistics.pstdev(wrong) == pytest.approx(0.5 * accuracy_m, rel=0.4), "each has its own"
    assert lidar.read(0, 0.0, 0.0, -8.5, LEVEL).current_distance == 801


def test_noise_sources_are_independent_and_repeatable() -> None:
    a, again, b = normals(1, "uas", "imu"), normals(1, "uas", "imu"), normals(1, "ugv", "imu")
    first = [a() for _ in range(3000)]
    assert first == [again() for _ in range(3000)]
    second = [b() for _ in range(3000)]
    assert abs(statistics.correlation(first, second)) < 0.06
    assert generator(2, "uas", "imu").standard_normal() != first[0]


def test_gauss_markov_has_its_spread_and_memory() -> None:
    process = GaussMarkov(2.0, 1.0, 0.1, normals(1, "x"))
    values = [process.step() for _ in range(20000)]
    assert statistics.pstdev(values) == pytest.approx(2.0, rel=0.1)
    assert statistics.correlation(values[:-10], values[10:]) == pytest.approx(math.exp(-1.0), abs=0.08)
