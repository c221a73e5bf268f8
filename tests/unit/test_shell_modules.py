"""What PX4's modules answer in the shell: whether they run, how they are, and what they are told to do."""

import pytest

from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.payload.camera_trigger import TIME_ALWAYS, CameraTrigger
from sitl_emu.autopilot.storage.dataman import FENCE, Plan
from sitl_emu.autopilot.topics import (
    ActuatorOutputs,
    HomePosition,
    VehicleGlobalPosition,
)
from sitl_emu.core import dialect as mavlink
from tests.unit.navigation_fake import HOME_ALT, HOME_LAT, HOME_LON, item
from tests.unit.shell_console import Console


def test_modules_say_whether_they_run() -> None:
    console, rover = Console(), Console("rover")
    assert console.output("mc_pos_control status") == "running\n"
    assert rover.output("mc_pos_control status").startswith("INFO  [px4] not running\nCommand")
    assert rover.output("land_detector status") == "INFO  [land_detector] running (rover)\n"
    assert console.output("ekf2 status").startswith("\nekf2:0 EKF dt: 0.0100s, attitude: 0, local position: 0,")
    assert console.output("navigator status") == (
        "INFO  [navigator] Running\nINFO  [navigator] Geofence: "
        "polygons: 0 inclusion, 0 exclusion, 0 vertices; circles: 0 inclusion, 0 exclusion\n"
    )
    assert console.output("commander start") == (
        "ERROR [px4] Task already running\nCommand 'commander' failed, returned -1.\n"
    )


def test_there_is_a_battery_simulator_where_the_battery_drains() -> None:
    """PX4's start-up script (init.d-posix/rcS)."""
    assert Console().output("battery_simulator status") == "running\n"
    console = Console(SIM_BAT_DRAIN=0.0)
    assert console.output("battery_simulator status").startswith("INFO  [px4] not running\n")


def test_ekf2_tells_its_states_and_their_covariance() -> None:
    """Lines as a real one prints them."""
    console = Console("sihsim_hex")
    ekf = console.autopilot.estimator.ekf
    ekf.origin_alt, ekf.state.alt, ekf.state.pn, ekf.state.terrain = 400.0, 403.5, 1.25, -399.0
    ekf.p[6, 6], ekf.p[6, 7], ekf.p[7, 6] = 0.25, 12.5, 0.125
    lines = console.output("ekf2 status -v").splitlines()
    assert lines[3:6] == [
        "States: (0.0000 seconds ago)",
        "Orientation (0-2): [1.000, 0.000, 0.000, 0.000] (Euler [0.0, 0.0, 0.0] deg) var: [0.0e+00, 0.0e+00, 0.0e+00]",
        "Velocity (3-5): [0.000, 0.000, 0.000] var: [0.0e+00, 0.0e+00, 0.0e+00]",
    ]
    assert lines[6].startswith("Position (6-8): [1.250, 0.000, -3.500] var: [2.5e-01,")
    assert lines[12] == "Terrain position (23): -399.000 var: 0.0e+00"
    heads, seventh = lines[15], lines[22]
    assert lines[14] == "P:" and heads.startswith("  | 0      | 1      ") and heads.endswith("|23      ")
    assert seventh[:3] == " 6|" and seventh[3 + 6 * 9 : 3 + 8 * 9] == " 0.25000  1.2e+01 "
    assert lines[40] == f"EKF average dt: {ekf.dt_s:.6f} seconds" and len(lines) == 41
    assert console.output("ekf2 select_instance 1") == (
        "ERROR [ekf2] multi-EKF not active, unable to select instance\n"
    )


def test_control_allocator_tells_what_each_motor_does() -> None:
    """Lines as a real one prints them (sihsim_hex)."""
    console = Console("sihsim_hex")
    assert console.output("control_allocator status").splitlines() == [
        "INFO  [control_allocator] Running",
        "INFO  [control_allocator] Method: Auto",
        "INFO  [control_allocator] Effectiveness Source: Multirotor",
        "INFO  [control_allocator]   Effectiveness =",
        "  | 0      | 1      | 2      | 3      | 4      | 5      ",
        "Mx|-3.25000 -6.50000 -3.25000  3.25000  6.50000  3.25000 ",
        "My| 5.62900  0       -5.62900 -5.62900  0        5.62900 ",
        "Mz| 0.32500 -0.32500  0.32500 -0.32500  0.32500 -0.32500 ",
        "Fx| 0        0        0        0        0        0       ",
        "Fy| 0        0        0        0        0        0       ",
        "Fz|-6.50000 -6.50000 -6.50000 -6.50000 -6.50000 -6.50000 ",
        "INFO  [control_allocator]   minimum =",
        "  | 0      | 1      | 2      | 3      | 4      | 5      ",
        "  | 0        0        0        0        0        0       ",
        "INFO  [control_allocator]   maximum =",
        "  | 0      | 1      | 2      | 3      | 4      | 5      ",
        "  | 1.00000  1.00000  1.00000  1.00000  1.00000  1.00000 ",
        "INFO  [control_allocator]   Configured actuators: 6",
    ]
    console.output("param set CA_R_REV 2")
    assert "  | 0       -1.00000  0       " in console.output("control_allocator status")
    console.output("param set CA_METHOD 7")
    assert "Method" not in console.output("control_allocator status")
    assert "not running" in Console("rover").output("control_allocator status")


@pytest.mark.parametrize(
    ("state", "task"),
    [(NavState.AUTO_LOITER, "active flight task: 0"), (NavState.ALTCTL, "active flight task: 6"),
     (NavState.ORBIT, "active flight task: 11"), (NavState.STAB, "no flight task active")],
)  # fmt: skip
def test_flight_mode_manager_tells_its_task(state: NavState, task: str) -> None:
    console = Console()
    topics = console.autopilot.topics
    topics.vehicle_status = topics.vehicle_status._replace(nav_state=state)
    assert console.output("flight_mode_manager status") == f"INFO  [flight_mode_manager] Running, {task}\n"
    assert state is not NavState.ALTCTL or "task: 5" in (
        console.output("param set MPC_POS_MODE 0") + console.output("flight_mode_manager status")
    )


def test_gimbal_and_camera_trigger_that_do_not_run_say_it_in_their_own_words() -> None:
    console = Console("sihsim_hex")
    assert console.output("gimbal status") == "INFO  [gimbal] not running\n"
    assert console.output("gimbal").startswith("ERROR [gimbal] missing command\nUsage: gimbal")
    assert console.output("gimbal").endswith("Command 'gimbal' failed, returned -1.\n")
    assert console.output("camera_trigger status") == (
        "WARN  [camera_trigger] not running\nCommand 'camera_trigger' failed, returned 1.\n"
    )
    assert Console("m600").output("gimbal status") == "running\n"


def test_camera_trigger_tells_how_it_triggers() -> None:
    console = Console()
    autopilot = console.autopilot
    trigger = CameraTrigger(autopilot.topics, autopilot.parameters, autopilot.outgoing)
    trigger.mode, trigger.enabled, trigger.interval_ms = TIME_ALWAYS, True, 40.0
    autopilot.camera_trigger = trigger
    assert console.output("camera_trigger status").splitlines() == [
        "INFO  [camera_trigger] trigger enabled : enabled",
        "INFO  [camera_trigger] trigger paused : active",
        "INFO  [camera_trigger] mode : 2",
        "INFO  [camera_trigger] interval : 40.00 [ms]",
        "INFO  [camera_trigger] activation time : 40.00 [ms]",
    ]


def test_outputs_tell_their_functions_and_what_they_carry() -> None:
    """pwm_out_sim, as a real one prints it: disarmed 900, a rover's armed and at rest 1500."""
    ends = "failsafe: 600.00, disarmed: 900, min: 1000, max: 2000, center: 0\n"
    hexacopter, rover = Console("sihsim_hex"), Console("sihsim_rover_ackermann")
    printed = hexacopter.output("pwm_out_sim status").splitlines(keepends=True)
    assert printed[2:6] == [
        "INFO  [mixer_module] Param prefix: PWM_MAIN\n",
        "control latency: 0 events, 0us elapsed, 0.00us avg, min 0us max 0us 0.000us rms\n",
        "INFO  [mixer_module] Switched to rate_ctrl work queue\n",
        "Channel Configuration:\n",
    ]
    assert printed[11] == f"Channel  5: func: 106, value: 900.00, {ends}"
    assert printed[12] == f"Channel  6: func:   0, value: 900.00, {ends}" and len(printed) == 22
    rover.autopilot.topics.actuator_outputs = ActuatorOutputs(1, (0.0, 0.0), (1500, 1500))
    assert f"Channel  0: func: 201, value: 1500.00, {ends}" in rover.output("pwm_out_sim status")


def test_what_a_module_does_not_understand_is_said_and_no_failure_but_the_commanders() -> None:
    console = Console()
    assert console.output("sensors").startswith("Usage: sensors") and "failed" not in console.output("sensors help")
    unknown = console.output("mc_att_control dance")
    assert unknown.startswith("WARN  [mc_att_control] unknown command\n\nUsage: ") and "failed" not in unknown
    assert console.output("load_mon dance").startswith("ERROR [load_mon] unknown command\n\nUsage: ")
    assert console.output("commander mode").startswith(
        "ERROR [commander] missing argument\nINFO  [commander] unknown command\nUsage: "
    )
    assert console.output("commander").endswith("failed, returned 1.\n")


def test_payload_deliverer_opens_and_closes_the_gripper() -> None:
    console = Console()
    topics = console.autopilot.topics
    assert console.output("payload_deliverer status") == (
        "INFO  [payload_deliverer] Gripper valid: True\nINFO  [payload_deliverer] Gripper state: GRABBING\n"
    )
    assert console.output("payload_deliverer gripper_open") == ""
    assert topics.gripper.position == -1.0
    assert console.output("payload_deliverer gripper_close") == ""
    assert topics.gripper.position == 1.0
    began_us = console.autopilot.now_us
    assert console.output("payload_deliverer gripper_test") == (
        "INFO  [payload_deliverer] Test: Opening the Gripper!\nINFO  [payload_deliverer] Test: Closing the Gripper!\n"
    )
    assert (topics.gripper.position, console.autopilot.now_us - began_us) == (1.0, 5_000_000)
    console.output("param set PD_GRIPPER_TYPE -1")
    assert console.output("payload_deliverer gripper_open").endswith("Gripper is not initialized correctly!\n")
    assert console.output("payload_deliverer dance").startswith("WARN  [payload_deliverer] Unrecognized command\n\n")


def test_failure_needs_its_parameter_and_lets_a_part_fail() -> None:
    console = Console()
    console.output("param set SYS_FAILURE_EN 0")
    assert console.output("failure gps off").startswith("ERROR [failure] Failure injection disabled by SYS_FAILURE_EN")
    console.output("param set SYS_FAILURE_EN 1")
    assert "inject failure unit: gps (4), type: off (1), instance: 0" in console.output("failure gps off")
    assert console.autopilot.topics.failure_injection.type_of(4, 1) == 1
    assert "Component 'nose' not found" in console.output("failure nose off")
    assert "ERROR [failure] Result: 3" in console.output("failure servo off")


def test_actuator_test_turns_one_motor_after_the_other() -> None:
    console = Console()
    assert console.output("actuator_test set -m 2 -v 0.1 -t 1") == ""
    test = console.autopilot.topics.actuator_test
    assert (test.function, test.value, test.timeout_us) == (102, 0.1, 1_000_000)
    printed = console.output("actuator_test iterate-motors")
    assert printed.count("INFO  [actuator_test] Motor ") == 12
    assert console.autopilot.topics.actuator_test.function == 112
    assert "value invalid" in console.output("actuator_test set -m 2 -v 7 -t 1")


def test_navigator_counts_the_areas_that_are_watched() -> None:
    """Geofence::printStatus; the circle that home would break is left out."""
    console = Console()
    autopilot = console.autopilot
    autopilot.topics.home_position = HomePosition(1, True, HOME_LAT, HOME_LON, HOME_ALT)
    corners = [(30.0, 30.0), (30.0, -30.0), (-30.0, 0.0)]
    triangle = [item(mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, *place, 0.0, 3.0) for place in corners]
    away = item(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 90.0, 0.0, 0.0, 10.0)
    around = item(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 0.0, 0.0, 0.0, 10.0)
    autopilot.dataman.store(FENCE, Plan((*triangle, away, around), 1), 0)
    autopilot.navigator.update(autopilot.now_us + 50_000)
    assert console.output("navigator status").endswith(
        "polygons: 1 inclusion, 0 exclusion, 3 vertices; circles: 0 inclusion, 1 exclusion\n"
    )


def test_navigator_makes_traffic_that_is_not_told_on_mavlink() -> None:
    """The last twenty of PX4's 25 reports; ten conflicts at most."""
    console = Console()
    autopilot = console.autopilot
    assert console.output("navigator fake_traffic") == ""
    autopilot.topics.vehicle_global_position = VehicleGlobalPosition(1, 1, 47.4, 8.5, 500.0, 500.0, True, True)
    assert console.output("navigator fake_traffic") == ""
    assert [report.icao_address for report in autopilot.topics.transponder_reports][:3] == [3, 4, 5]
    for _ in range(25):
        autopilot.now_us += 50_000
        autopilot.navigator.update(autopilot.now_us)
        autopilot.mavlink.update(autopilot.now_us)
    assert autopilot.navigator.traffic.conflicts == [5, 6, 7, 8, 9, 10, 11, 12, 13, 14]
    assert console.output("navigator fake_traffic").split()[-1] == "14"
