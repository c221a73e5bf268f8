"""The shell's commands of PX4's simulation beside its modules: each is there, and says whether it runs."""

import pytest

from sitl_emu.autopilot.topics import GroundTruth
from tests.unit.shell_console import Console

VTE = "vision_target_estimator status"
FAILED = "Command '{}' failed, returned {}.\n"


@pytest.fixture(scope="module")
def hexacopter() -> Console:
    return Console("sihsim_hex")


@pytest.mark.parametrize(
    "name",
    ["fw_att_control", "vtol_att_control", "airspeed_selector", "temperature_compensation", "send_event",
     "camera_feedback", "sensor_agp_sim", "rover_mecanum", "replay", "msp_osd"],
)  # fmt: skip
def test_what_a_multicopter_does_not_start_says_so(hexacopter: Console, name: str) -> None:
    assert hexacopter.output(f"{name} status") == "INFO  [px4] not running\n" + FAILED.format(name, -1)
    assert hexacopter.output(name).startswith(f"Usage: {name} ")


@pytest.mark.parametrize("sensor", ["baro", "gps", "mag"])
def test_sensors_that_px4_simulates_run_where_they_were_started(hexacopter: Console, sensor: str) -> None:
    """px4-rc.sihsim; an iris has a simulator outside."""
    command = f"sensor_{sensor}_sim status"
    assert hexacopter.output(command) == "running\n"
    left_out = Console("sihsim_hex", None, **{f"SENS_EN_{sensor.upper()}SIM": 0})
    assert left_out.output(command).startswith("INFO  [px4] not running\n")
    assert (Console("iris").output(command) == "running\n") is (sensor == "gps")


def test_camera_feedback_comes_with_the_trigger() -> None:
    assert Console("iris", TRIG_MODE=1).output("camera_feedback status") == "running\n"


def test_one_of_two_simulators_runs(hexacopter: Console) -> None:
    iris = Console("iris")
    hexacopter.autopilot.topics.groundtruth = GroundTruth(1, x=1.5, y=0.0, z=-2.0, vx=0.5, vy=0.0, vz=0.0)
    lines = hexacopter.output("simulator_sih status").splitlines()
    assert lines[:4] == [
        "INFO  [simulator_sih] Running in lockstep mode",
        "INFO  [simulator_sih] local position NED (m)",
        "  | 0      | 1      | 2      ",
        " 0| 1.50000  0       -2.00000 ",
    ]
    assert lines[7:11] == [
        "INFO  [simulator_sih] attitude roll-pitch-yaw (deg)",
        *(f" {n}| 0       " for n in range(3)),
    ]
    assert lines[-2] == "  | 0      | 1      | 2      | 3      | 4      | 5      | 6      | 7      "
    assert iris.output("simulator_sih status").startswith("INFO  [px4] not running\n")
    assert iris.output("simulator_mavlink status") == "INFO  [simulator_mavlink] running\n"
    assert hexacopter.output("simulator_mavlink status") == (
        "WARN  [simulator_mavlink] Simulator not running\n" + FAILED.format("simulator_mavlink", 1)
    )


def test_gyro_calibration_tells_what_it_has() -> None:
    console = Console()
    calibration = console.autopilot.gyro_calibration
    calibration.count, calibration._mean, calibration._squares = 3, [0.1, 0.0, -0.2], [0.002, 0.0, 0.0]
    assert console.output("gyro_calibration status") == (
        "gyro 0 (1310988), [0.10000, 0.00000, -0.20000] var: [0.001000000, 0.000000000, 0.000000000] "
        "15.0 degC (count 3)\n"
    )
    without = Console(IMU_GYRO_CAL_EN=0)
    assert without.output("gyro_calibration status").startswith("INFO  [px4] not running\n")


@pytest.mark.parametrize(
    ("line", "printed"),
    [
        ("perf", ""),
        ("perf reset", ""),
        ("work_queue status", "\nWork Queue: 0  threads                          RATE        INTERVAL\n"),
        ("led_control on -c red", ""),
        ("led_control blink -n 5 -s fast -l 0", ""),
        ("tune_control play -t 1", ""),
        ("tune_control play error", ""),
        ("tune_control stop", "INFO  [tune_control] Stopping playback...\n"),
        ("tune_control play -m MFT200e8",
         "INFO  [tune_control] Start playback...\nINFO  [tune_control] Playback finished.\n"),
    ],
)  # fmt: skip
def test_what_is_understood(hexacopter: Console, line: str, printed: str) -> None:
    assert hexacopter.output(line) == printed


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("perf status", -1),
        ("work_queue", 1),
        ("led_control", 1),
        ("led_control status", 1),
        ("led_control on -c pink", 1),
        ("led_control on -x 1", -1),
        ("led_control on -c", -1),
        ("tune_control", 1),
        ("tune_control status", 1),
        ("tune_control play -t 20", 1),
        ("tune_control play -m e8", 1),
        ("tune_control play -f 22000", 1),
    ],
)
def test_what_is_not_understood_fails_with_the_usage(hexacopter: Console, line: str, status: int) -> None:
    name = line.split()[0]
    printed = hexacopter.output(line)
    assert printed.startswith(f"Usage: {name} ") and printed.endswith(FAILED.format(name, status))


def test_play_needs_something_to_play(hexacopter: Console) -> None:
    assert hexacopter.output("tune_control play").startswith("WARN  [tune_control] Missing argument\nUsage: ")


def test_vision_target_estimator_tells_what_it_may_use(hexacopter: Console) -> None:
    """Lines as a real one prints them (sihsim_hex); VTE_EN 0 leaves it out of a start (rc.mc_apps)."""
    told = [line.removeprefix("INFO  [vision_target_estimator] ") for line in hexacopter.output(VTE).splitlines()]
    assert told == [
        "VTE running",
        "target model: static",
        "work queue: wq:vte",
        "current task: none",
        "task mask: 0x01 (prec_land: yes, debug: no)",
        "aid mask: 0x000e",
        "  vision pos: yes, target gps pos: no, mission pos: yes",
        "  uav gps vel: yes, target gps vel: no",
        "position vte: enabled: yes, available: yes, running: no, fusing: yes, timed out: no",
        "orientation vte: enabled: no, available: no, running: no, fusing: no, timed out: no",
    ]
    assert Console("sihsim_hex", VTE_EN=0).output(VTE).startswith("INFO  [px4] not running\n")
    assert Console("rover").output(VTE).startswith("INFO  [px4] not running\n")
