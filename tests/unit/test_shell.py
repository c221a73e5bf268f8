"""The MAVLink shell on simulated time: PX4's console over SERIAL_CONTROL."""

import math
import random

import pytest

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.mavlink.mavlink import Modules
from sitl_emu.autopilot.shell.commands import COMMANDS
from sitl_emu.autopilot.shell.pxh import INPUT_BYTES, LINE_CHARACTERS, OUTPUT_BYTES, Pxh
from sitl_emu.autopilot.topics import (
    AuxGlobalPosition,
    CpuLoad,
    DebugKeyValue,
    EscStatus,
    EstimatorStatus,
    PositionSetpointTriplet,
    RadioStatus,
    TelemetryStatus,
    VehicleCommand,
    VehicleMagnetometer,
    topic_names,
)
from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs import shell as gcs_shell
from tests.unit.mavlink_peer import GCS, ONBOARD, HandleCommand, Peer
from tests.unit.shell_console import TICK_US, Console


@pytest.fixture(scope="module")
def console() -> Console:
    return Console()


def test_every_line_is_echoed_and_followed_by_the_prompt(console: Console) -> None:
    assert console.type("\n") == "\npxh> "
    assert console.type("# a remark\n") == "# a remark\npxh> "
    assert console.type("ver hw\r\nver mcu\n") == "ver hw\r\nHW arch: PX4_SITL\npxh> ver mcu\nUNKNOWN MCU\npxh> "


def test_control_characters_up_to_3_and_bytes_from_128_on_are_ignored_and_a_backspace_is_a_character() -> None:
    console = Console()
    console.pxh.write(b"\x03\x00ver\xff hw\x80\n")
    console.pxh.run()
    assert console.pxh.read(1000) == b"ver hw\nHW arch: PX4_SITL\npxh> "
    assert "Invalid command: verx\x7f" in console.type("verx\x7f hw\n")


def test_a_command_that_fails_says_so(console: Console) -> None:
    assert console.output("ver nothing") == "ERROR [ver] unknown command\nCommand 'ver' failed, returned 1.\n"
    assert console.output("nosuchcommand").startswith("Invalid command: nosuchcommand\ntype 'help'")
    assert "failed" not in console.output("nosuchcommand")


def test_help_names_every_command(console: Console) -> None:
    names = console.output("help").splitlines()
    assert names[0] == "Builtin Commands:"
    assert [name.strip() for name in names[1:]] == sorted(COMMANDS)


@pytest.mark.parametrize("name", sorted(COMMANDS))
@pytest.mark.parametrize("words", ["", "status", "help", "x" * 900, "-n -n -n", "set", "start", "show * *", "\x1b[A"])
def test_no_words_break_a_command(console: Console, name: str, words: str) -> None:
    assert console.type(f"{name} {words}\n").endswith("pxh> ")


def test_commander_gives_commands_from_inside() -> None:
    console = Console()
    assert console.output("commander status").startswith(
        "INFO  [commander] Disarmed\nINFO  [commander] prearm safety: "
    )
    assert "INFO  [commander] navigation mode: " in console.output("commander status")
    assert console.output("commander mode nosuch") == "ERROR [commander] argument nosuch unsupported.\n"
    assert console.output("commander mode position:slow") == ""
    assert console.autopilot.topics.vehicle_status.nav_state_user_intention.name == "POSITION_SLOW"
    assert console.output("commander mode auto:land") == ""
    assert console.autopilot.topics.vehicle_status.nav_state_user_intention.name == "AUTO_LAND"
    assert console.output("commander check") == "INFO  [commander] Preflight check: FAILED\n"
    assert console.output("commander safety") == (
        "ERROR [commander] missing argument\nCommand 'commander' failed, returned 1.\n"
    )
    assert console.output("commander safety off") == ""
    assert "unsupported" in console.output("commander actuator_group_test wings")
    assert console.output("commander actuator_group_test roll") == ""
    assert console.output("commander actuator_group_test zthrust much") == (
        'WARN  [commander] actuator_group_test: value "much" is invalid. Using default -0.1\n'
    )
    assert "[commander] Invalid heading value: 9x\n" in console.output("commander calibrate mag quick 9x")
    assert console.output("commander set_heading") == "ERROR [commander] missing argument\n"
    assert console.output("commander set_heading 90") == ""
    assert console.output("commander termination") == ""


def test_pairing_is_asked_of_everybody_and_says_nothing() -> None:
    """VEHICLE_CMD_START_RX_PAIR to system and component 0 (Commander::custom_command)."""
    console = Console()
    assert console.output("commander pair") == ""
    (command,) = console.autopilot.outgoing.waiting
    assert command[:2] == (mavlink.MAV_CMD_START_RX_PAIR, 10.0) and all(map(math.isnan, command[2:8]))
    assert (command.target_system, command.target_component, command.from_external) == (0, 0, False)


@pytest.mark.parametrize(("number", "param4"), [(31999, 0.0), (mavlink.MAV_CMD_PREFLIGHT_CALIBRATION, 3.0)])
def test_commands_that_are_unsupported_stand_in_the_log(number: int, param4: float) -> None:
    """Commander::answer_command."""
    autopilot = Console().autopilot
    result = autopilot.commands.handle(0, VehicleCommand(number, 0.0, 0.0, 0.0, param4, 0.0, 0.0, 0.0))
    assert result is not None and result.result == mavlink.MAV_RESULT_UNSUPPORTED
    line = autopilot.texts.lines[-1]
    assert (line.severity, line.line) == (Severity.WARNING, f"[commander] command {number} unsupported")


def test_listener_prints_a_topic_with_its_age() -> None:
    console = Console()
    assert console.output("listener nosuch") == (
        "Topic nosuch did not match any known topics\nCommand 'listener' failed, returned -1.\n"
    )
    assert console.output("listener vehicle_attitude") == "never published\n"
    topics = console.autopilot.topics
    console.autopilot.now_us = 3_000_000
    topics.vehicle_attitude = topics.vehicle_attitude._replace(timestamp=2_500_000, q=(0.0, 0.0, 0.0, 1.0))
    printed = console.output("listener vehicle_attitude")
    assert printed.startswith(
        "\nTOPIC: vehicle_attitude\n vehicle_attitude\n    timestamp: 2500000 (0.500000 seconds ago)\n"
    )
    assert "    timestamp_sample: 2500000 (0 us before timestamp)\n" in printed
    assert "    q: [0.00000, 0.00000, 0.00000, 1.00000] (Roll: 0.0 deg, Pitch: 0.0 deg, Yaw: 180.0 deg)\n" in printed
    assert printed.endswith("    quat_reset_counter: 0\n\n")
    printed = console.output("listener vehicle_attitude -n 3")
    assert printed.startswith("\x1b[2J\n\x1b[H\nTOPIC: vehicle_attitude instance 0 #1\n")
    assert printed.count("TOPIC: vehicle_attitude instance 0 #") == 1
    assert printed.endswith("Waited for 2.0 seconds without a message. Giving up.\n")


def test_listener_with_a_rate_alone_prints_thirty_seconds() -> None:
    console = Console()
    autopilot = console.autopilot
    autopilot.now_us = 1_000_000
    console.pxh.write(b"listener vehicle_attitude -r 2\n")
    for _ in range(round(31e6 / TICK_US)):
        autopilot.now_us += TICK_US
        autopilot.topics.vehicle_attitude = autopilot.topics.vehicle_attitude._replace(timestamp=autopilot.now_us)
        console.pxh.run()
    printed = console.pxh.read(1 << 20).decode()
    assert printed.count("TOPIC: ") == 60 and printed.endswith("pxh> ")


def test_listener_knows_px4s_names_and_fields_of_what_is_logged() -> None:
    console = Console()
    console.autopilot.now_us = 2_000_000
    topics = console.autopilot.topics
    topics.vehicle_magnetometer = VehicleMagnetometer(1_900_000, 1_900_000, (0.2, 0.0, 0.4))
    assert console.output("listener vehicle_magnetometer") == (
        "\nTOPIC: vehicle_magnetometer\n vehicle_magnetometer\n"
        "    timestamp: 1900000 (0.100000 seconds ago)\n"
        "    timestamp_sample: 1900000 (0 us before timestamp)\n"
        "    device_id: 197388 (Type: 0x03, SIMULATION:1 (0x03))\n"
        "    magnetometer_ga: [0.20000, 0.00000, 0.40000]\n"
        "    calibration_count: 0\n\n"
    )
    topics.estimator_status = EstimatorStatus(1_000_000, 1_000_000, control_mode_flags=7)
    assert "    control_mode_flags: 7 (0b111)\n" in console.output("listener estimator_status")
    topics.position_setpoint_triplet = PositionSetpointTriplet(1_000_000)
    triplet = console.output("listener position_setpoint_triplet")
    assert triplet.startswith("\nTOPIC: position_setpoint_triplet\n position_setpoint_triplet\n    timestamp: ")
    assert "    gliding_enabled: False\n\n  current (position_setpoint):\n    timestamp: " in triplet


def test_listener_prints_empty_lines_where_px4_does() -> None:
    """orb_print_message_internal ends a line for fields that fill a struct up, and for texts (uORB.cpp)."""
    console = Console()
    console.autopilot.now_us = 1_100_000
    topics = console.autopilot.topics
    topics.cpuload = CpuLoad(1_000_000, 0.25, 0.5)
    assert console.output("listener cpuload") == (
        "\nTOPIC: cpuload\n cpuload\n    timestamp: 1000000 (0.100000 seconds ago)\n"
        "    load: 0.25000\n    ram_usage: 0.50000\n"
    )
    topics.debug_key_value = DebugKeyValue(1_000_000, b"hello", 3.5)
    assert console.output("listener debug_key_value") == (
        "\nTOPIC: debug_key_value\n debug_key_value\n    timestamp: 1000000 (0.100000 seconds ago)\n"
        '    value: 3.50000\n    key: "hello"\n\n\n'
    )
    topics.esc_status = EscStatus(1_000_000, (0,) * 4)
    reports = console.output("listener esc_status")
    assert "    esc_connectiontype: 0\n  esc[0] (esc_report):\n    timestamp: 1000000 (" in reports
    assert reports.count("    esc_power: 0\n\n  esc[") == 11 and reports.endswith("    esc_power: 0\n\n")


def test_listener_prints_all_instances_unless_one_is_asked_for() -> None:
    console = Console()
    console.autopilot.now_us = 1_500_000
    topics = console.autopilot.topics
    topics.telemetry_status = TelemetryStatus(1_000_000, mode=0)
    topics.telemetry_status_1 = TelemetryStatus(1_100_000, mode=2)
    printed = console.output("listener telemetry_status")
    assert printed.startswith(
        "\nTOPIC: telemetry_status 2 instances\n\nInstance 0:\n telemetry_status\n    timestamp: 10000"
    )
    assert printed.count("\n\nInstance 1:\n telemetry_status\n    timestamp: 1100000 (0.400000 seconds ago)\n") == 1
    one = console.output("listener telemetry_status -i 1")
    assert one.startswith("\nTOPIC: telemetry_status instance 1 #1\n") and "    mode: 2\n" in one


def test_listener_prints_every_topic_there_is() -> None:
    console = Console()
    console.autopilot.now_us = 2_000_000
    topics = console.autopilot.topics
    for name in topic_names(topics):
        record = getattr(topics, name)
        if hasattr(record, "timestamp"):
            setattr(topics, name, record._replace(timestamp=1_000_000))
    topics.aux_global_position = (AuxGlobalPosition(1_000_000, 1_000_000, 1, 47.0, 8.0),)
    first = [topic for topic in console.autopilot.logger.topics() if not topic.instance]
    names = {*topic_names(topics), *(topic.name for topic in first)}
    for name in names:
        printed = console.output(f"listener {name}")
        assert printed.startswith(f"\nTOPIC: {name}") and f"\n {name}\n" in printed, name


def test_uorb_top_measures_once_as_nobody_could_end_it() -> None:
    console = Console()
    began_us = console.autopilot.now_us
    printed = console.output("uorb top")
    assert 2_000_000 <= console.autopilot.now_us - began_us < 2_100_000
    assert printed.startswith("\x1b[2J\n\x1b[Kupdate: 1s, topics: ") and "vehicle_status" not in printed
    assert "vehicle_status" in console.output("uorb top -a")
    chosen = console.output("uorb top _status").splitlines()[3:]
    assert any("vehicle_status " in line for line in chosen) and all("_status" in line for line in chosen)


def test_system_time_tells_the_date_and_how_long_it_runs() -> None:
    console = Console()
    console.autopilot.now_us = 62_000_000
    boot_s = console.autopilot.mavlink.context.boot_unix_us // 1_000_000
    assert console.output("system_time get") == (
        f"INFO  [system_time] Unix epoch time: {boot_s + 62}\n"
        "INFO  [system_time] System time: Thu 2026-01-01 00:01:02 UTC\n"
        "INFO  [system_time] Uptime (since boot): 62 s\n"
    )
    assert console.output("system_time").startswith("ERROR [system_time] system_time: not enough arguments\nUsage: ")
    assert console.output("system_time set 7").startswith("ERROR [system_time] system_time: Unknown subcommand\n")


def test_a_logger_that_was_not_started_does_nothing() -> None:
    console = Console()
    console.autopilot.logger._backend = 0
    assert console.output("logger status").startswith("INFO  [px4] not running\n")
    assert console.output("logger on").startswith("WARN  [logger] logger not running\n\nUsage: logger")


def test_sleep_takes_vehicle_time_and_input_waits() -> None:
    console = Console()
    began_us = console.autopilot.now_us
    console.pxh.write(b"sleep 1\nver hw\n")
    console.pxh.run()
    assert console.pxh.read(1000) == b"sleep 1\nSleeping for 1 s; (1000000 us).\n"
    assert console.type("") == "pxh> ver hw\nHW arch: PX4_SITL\npxh> "
    assert console.autopilot.now_us - began_us == 1_000_000


def test_input_without_end_keeps_memory_bounded() -> None:
    console = Console()
    noise = random.Random(1)
    for _ in range(160):
        console.pxh.write(noise.randbytes(65536))
        console.pxh.run()
        assert len(console.pxh._input) <= INPUT_BYTES
        assert len(console.pxh._line) <= LINE_CHARACTERS
        assert len(console.pxh._output) <= 2 * OUTPUT_BYTES + INPUT_BYTES
    while console.pxh.read(1 << 30):
        console.pxh.run()
    assert console.type("\nver hw\n").endswith("HW arch: PX4_SITL\npxh> ")


# --- over MAVLink ---------------------------------------------------------------------------------------------


class ShellPeer(Peer):
    """A ground station at the shells of an autopilot that stands."""

    def __init__(self) -> None:
        self.autopilot = Autopilot(vehicles.load("iris").airframe, 0)
        super().__init__()

    def modules(self, handle_command: HandleCommand) -> Modules:
        return Modules(handle_command, open_shell=lambda: Pxh(COMMANDS, self.autopilot))

    def type(self, text: str, link: int = GCS, seconds: float = 0.4) -> str:
        for message in gcs_shell.typed(text):
            self.send(message, link)
        return "".join(gcs_shell.printed(message) for message in self.run(seconds, link))


def test_a_shell_of_its_own_for_each_link() -> None:
    peer = ShellPeer()
    assert peer.type("ver ") == "ver "
    assert peer.type("ver hw\n", ONBOARD) == "ver hw\nHW arch: PX4_SITL\npxh> "
    assert peer.type("hw\n") == "hw\nHW arch: PX4_SITL\npxh> "


def test_output_is_cut_to_70_bytes_and_paced_to_one_message_a_tick() -> None:
    peer = ShellPeer()
    for message in gcs_shell.typed("param show COM*\n"):
        peer.send(message)
    counts = []
    for _ in range(20):
        replies = [message for message in peer.run(0.004) if message.get_type() == "SERIAL_CONTROL"]
        assert len(replies) <= 1
        counts += [message.count for message in replies]
        assert all((m.flags, m.device, m.timeout, m.baudrate) == (1, 10, 0, 0) for m in replies)
    assert set(counts) == {70} and len(counts) == 20


def test_without_respond_the_shell_closes_and_with_reply_nothing_is_typed() -> None:
    peer = ShellPeer()
    peer.type("half a li")
    peer.send(gcs_shell.closing())
    assert peer.type("ver hw\n") == "ver hw\nHW arch: PX4_SITL\npxh> "
    data = list(b"ver hw\n".ljust(70, b"\0"))
    peer.send(mavlink.MAVLink_serial_control_message(10, 1 | 2, 0, 0, 7, data))
    peer.send(mavlink.MAVLink_serial_control_message(0, 2, 0, 0, 7, data))
    peer.send(mavlink.MAVLink_serial_control_message(10, 2, 0, 0, 255, data))
    assert peer.type("", seconds=0.1) == ""


def test_what_is_typed_with_the_closing_message_is_done_unheard() -> None:
    peer = ShellPeer()
    data = list(b"commander mode auto:land\n".ljust(70, b"\0"))
    peer.send(mavlink.MAVLink_serial_control_message(10, 0, 0, 0, 25, data))
    assert "SERIAL_CONTROL" not in {message.get_type() for message in peer.run(0.2)}
    assert peer.autopilot.topics.vehicle_status.nav_state_user_intention.name == "AUTO_LAND"


def test_an_open_shell_shows_what_the_autopilot_says() -> None:
    peer = ShellPeer()
    peer.type("\n")
    peer.texts.say(Severity.CRITICAL, "Arming denied: high throttle\t")
    assert peer.type("", seconds=0.1) == "WARN  [commander] Arming denied: high throttle\t\n"


def test_the_ground_stations_half_runs_a_line() -> None:
    peer = ShellPeer()
    command = gcs_shell.ShellCommand("ver hw")
    for message in command.on_time(0):
        peer.send(message)
    while not command.done:
        for message in peer.run(0.02):
            command.on_message(peer.now_us, message)
    assert (command.output, command.failed) == ("HW arch: PX4_SITL\n", False)
    lonely = gcs_shell.ShellCommand("ver hw")
    lonely.on_time(0)
    lonely.on_time(5_000_001)
    assert lonely.done and lonely.failed


def test_mavlink_tells_of_a_radio() -> None:
    """mavlink_main.cpp, display_status."""
    console = Console()
    assert "\ttype:\t\tGENERIC LINK OR RADIO\n" in console.output("mavlink status")
    console.autopilot.mavlink.links[GCS].radio = RadioStatus(0, 200, 180, 90, 40, 42, 3, 7)
    assert (
        "\ttype:\t\tRADIO Link\n\t  rssi:\t\t200\n\t  remote rssi:\t180\n\t  txbuf:\t90\n\t  noise:\t40\n"
        "\t  remote noise:\t42\n\t  rx errors:\t3\n\t  fixed:\t7\n"
    ) in console.output("mavlink status")


def test_mavlink_tells_how_long_answers_to_pings_take_and_which_link_there_is_not() -> None:
    console = Console()
    assert "ping statistics" not in console.output("mavlink status")
    console.autopilot.mavlink.links[GCS].pings.answered(4.0, 1)
    assert (
        "\tping statistics:\n\t  last: 4.00 ms\n\t  mean: 2.00 ms\n\t  max: 4.00 ms\n\t  min: 4.00 ms\n"
        "\t  dropped packets: 0\n"
    ) in console.output("mavlink status")
    for words, answer in (
        ("", "mavlink for network on port 0 is not running"),
        ("-d /dev/ttyS1", "mavlink for device /dev/ttyS1 is not running"),
        ("-d /dev/ttyS1 -u 18570", "please provide either a device name or a network port"),
    ):
        assert console.output(f"mavlink stream -s ATTITUDE {words}").startswith(f"WARN  [mavlink] {answer}\n")
    assert console.output("mavlink stream -u 18570 -s ATTITUDE -r -1").startswith("Usage: mavlink")
