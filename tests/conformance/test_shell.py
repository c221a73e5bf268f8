"""MAVLink shell: SERIAL_CONTROL of device SHELL."""

import re
import struct
import time
from typing import Any

import pytest

PAGE = "https://mavlink.io/en/messages/common.html#SERIAL_CONTROL"
DEVICE_SHELL, DEVICE_GPS1 = 10, 2
REPLY, RESPOND, EXCLUSIVE, MULTI = 1, 2, 4, 16
DATA_BYTES = 70
PROMPT, OF_NUTTX = "pxh> ", b"nsh> "
TRIES, LIMIT_S = 3, 5.0
OF_MODULES = re.compile(
    r"(?:\x1b\[\d*m)*(?:INFO|WARN|ERROR) +(?:\x1b\[\d*m)*\[\w+\][^\n]*\n|Remote shell write: Broken pipe\n"
)
"""What PX4's modules print meanwhile goes to the shell that is open, too: on a used one, several times a second. So
does what is said of the shell before (pxh.cpp, run_remote_pxh), which nobody reads any more."""
pytestmark = [
    pytest.mark.covers("SERIAL_CONTROL", source=PAGE),
    pytest.mark.covers("SERIAL_CONTROL", source="measured misc/shell/*: what PX4's SITL shell answers"),
]


def send(station: Any, text: str, flags: int = RESPOND | EXCLUSIVE | MULTI, device: int = DEVICE_SHELL) -> None:
    """Type into the shell, 70 bytes a message."""
    data = text.encode()
    for at in range(0, max(len(data), 1), DATA_BYTES):
        part = data[at : at + DATA_BYTES]
        station.mav.serial_control_send(device, flags, 0, 0, len(part), list(part.ljust(DATA_BYTES, b"\0")))


def close(station: Any) -> None:
    """End the shell of this link, and read what it still says."""
    send(station, "", flags=0)
    station.collect("SERIAL_CONTROL", 0.3)


def output(station: Any, *lines: str) -> str:
    """What the shell prints up to its prompt when lines, or pieces of one, are typed.

    A shell of PX4's SITL that ends gives the process its output back, also when the next one has already taken it
    (pxh.cpp, run_remote_pxh): what that one prints is then lost, and it is asked again in a new shell.
    """
    printed = ""
    for _ in range(TRIES):
        printed = ""
        for text in lines:
            send(station, text)
        end_s = time.monotonic() + LIMIT_S
        while not printed.endswith(PROMPT) and (left_s := end_s - time.monotonic()) > 0.0:
            message = station.receive("SERIAL_CONTROL", left_s)
            if message is not None:
                told = (message.flags, message.device, message.timeout, message.baudrate)
                assert told == (REPLY, DEVICE_SHELL, 0, 0)
                printed = OF_MODULES.sub("", printed + bytes(message.data[: message.count]).decode())
        if printed.endswith(PROMPT):
            break
        close(station)
    return printed


def skip_on_a_board(station: Any) -> None:
    """What a board's shell prints is NuttX's, and was not measured."""
    send(station, "\n")
    printed = station.collect("SERIAL_CONTROL", 1.0, at_least=1)
    close(station)
    if OF_NUTTX in b"".join(bytes(message.data[: message.count]) for message in printed):
        pytest.skip("holds for the shell of PX4's simulation (pxh): this is NuttX's (nsh)")


@pytest.fixture(scope="module", autouse=True)
def of_the_simulation(station: Any) -> None:
    skip_on_a_board(station)


@pytest.fixture(autouse=True)
def closed_shell(station: Any) -> Any:
    """Every test begins and ends without a shell on its link."""
    close(station)
    yield
    send(station, "", flags=0)


def test_a_line_is_echoed_and_answered_with_output_and_prompt(station: Any) -> None:
    assert output(station, "\n") == "\n" + PROMPT
    assert output(station, "ver hw\n") == "ver hw\nHW arch: PX4_SITL\n" + PROMPT
    value = station.parameter_bytes("COM_RC_LOSS_T")
    assert value is not None
    (number,) = struct.unpack("<f", value)
    assert output(station, "param show -q COM_RC_LOSS_T\n") == f"param show -q COM_RC_LOSS_T\n{number:.4f}\n{PROMPT}"


def test_what_is_no_command_is_named_with_a_hint(station: Any) -> None:
    hint = "type 'help' for a list of commands"
    assert output(station, "nosuchcommand\n") == f"nosuchcommand\nInvalid command: nosuchcommand\n{hint}\n{PROMPT}"


def test_a_line_may_come_in_pieces_and_may_be_longer_than_a_message(station: Any) -> None:
    assert output(station, "ver ", "hw\n").endswith("HW arch: PX4_SITL\n" + PROMPT)
    line = "ver hw" + " " * DATA_BYTES
    assert output(station, line + "\n") == f"{line}\nHW arch: PX4_SITL\n{PROMPT}"


def test_a_carriage_return_before_the_line_feed_does_not_matter(station: Any) -> None:
    assert output(station, "ver hw\r\n") == "ver hw\r\nHW arch: PX4_SITL\n" + PROMPT


def test_listener_prints_a_topic_field_by_field(station: Any) -> None:
    """PX4: orb_print_message_internal (uORB.cpp); a time with its age, a quaternion with its angles."""
    printed = output(station, "listener vehicle_attitude\n")
    number, angle = r"-?\d+\.\d{5}", r"-?\d+\.\d deg"
    four = ", ".join([number] * 4)
    wanted = (
        "\nTOPIC: vehicle_attitude\n vehicle_attitude\n"
        r"    timestamp: \d+ \(\d+\.\d{6} seconds ago\)\n"
        r"    timestamp_sample: \d+ \(\d+ us before timestamp\)\n"
        rf"    q: \[{four}\] \(Roll: {angle}, Pitch: {angle}, Yaw: {angle}\)\n"
        rf"    delta_q_reset: \[{four}\]\n"
        r"    quat_reset_counter: \d+\n"
    )
    assert re.search(wanted, printed), printed


def test_another_device_is_not_the_shell(station: Any) -> None:
    send(station, "ver hw\n", device=DEVICE_GPS1)
    assert not station.collect("SERIAL_CONTROL", 1.0)


def test_a_message_without_respond_closes_the_shell_and_what_was_typed_is_forgotten(station: Any) -> None:
    send(station, "nosuch")
    station.collect("SERIAL_CONTROL", 0.5)
    close(station)
    assert output(station, "ver hw\n") == "ver hw\nHW arch: PX4_SITL\n" + PROMPT
