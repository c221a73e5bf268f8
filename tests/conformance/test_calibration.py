"""Preflight calibration: answers, texts that a ground station follows, cancelling."""

import struct
import time
from collections.abc import Iterator
from typing import Any

import pytest

PREFLIGHT_CALIBRATION, PREFLIGHT_STORAGE, FIXED_MAG_CAL_YAW = 241, 245, 42006
ACCEPTED, TEMPORARILY_REJECTED, UNSUPPORTED = 0, 1, 3
STANDBY, CALIBRATING = 3, 2
GYRO, MAG, ACCEL, AIRSPEED = (1,), (0, 1), (0, 0, 0, 0, 1), (0, 0, 0, 0, 0, 1)
NOTHING = (0,)
INT32, REAL32 = 6, 9
OF_A_GYRO = {"ID": INT32, "PRIO": INT32, "ROT": INT32, "XOFF": REAL32, "YOFF": REAL32, "ZOFF": REAL32}
GYRO_PARAMETERS = {f"CAL_GYRO{number}_{name}": kind for number in range(4) for name, kind in OF_A_GYRO.items()}
TRIES = 3
CANCELLED = "[cal] calibration cancelled"
PROGRESS = "[cal] progress <"
RETRYING = "motion, retrying.."
"""To noise that looks like motion: a median of nine samples 0.6 deg/s off the mean (gyro_calibration.cpp), in one of
thirty calibrations at the 0.01 rad/s of PX4's SIH."""

pytestmark = [
    pytest.mark.covers(
        "MAV_CMD_PREFLIGHT_CALIBRATION",
        source="https://mavlink.io/en/messages/common.html#MAV_CMD_PREFLIGHT_CALIBRATION",
    ),
    pytest.mark.covers("STATUSTEXT", source="https://docs.px4.io/v1.18/en/config/sensors"),
]


def calibrate(station: Any, *params: float) -> int | None:
    """The first answer."""
    result: int | None = station.command(PREFLIGHT_CALIBRATION, *params)
    return result


def texts_until(station: Any, wanted: str, limit_s: float) -> list[str]:
    """Texts up to the one that begins so."""
    end_s, texts = time.monotonic() + limit_s, list[str]()
    while (left_s := end_s - time.monotonic()) > 0.0:
        message = station.receive("STATUSTEXT", left_s)
        if message is not None:
            texts.append(message.text)
            if message.text.startswith(wanted):
                break
    return texts


def is_cancelled(station: Any) -> bool:
    """Whether a cancellation is told; PX4 misses one that comes between two parts of a calibration."""
    for _ in range(10):
        station.mav.command_long_send(station.system, 1, PREFLIGHT_CALIBRATION, 0, *(0.0,) * 7)
        if CANCELLED in texts_until(station, CANCELLED, 3.0):
            return True
    return False


@pytest.fixture(autouse=True)
def idle(station: Any) -> Iterator[None]:
    """Whatever a test leaves running is cancelled: PX4 is in standby again when its worker is free."""
    yield
    end_s = time.monotonic() + 30.0
    while (status := station.heartbeat().system_status) != STANDBY and time.monotonic() < end_s:
        if status == CALIBRATING:
            calibrate(station, *NOTHING)
    assert status == STANDBY


def gyro_parameters(station: Any) -> dict[str, bytes | None]:
    return {name: station.parameter_bytes(name) for name in GYRO_PARAMETERS}


def give_back(station: Any, before: dict[str, bytes | None]) -> None:
    """Set what is no longer as it was; PX4, which learns offsets at rest as well, may go on from there."""
    for _ in range(TRIES):
        now = gyro_parameters(station)
        changed = {name: value for name, value in before.items() if value is not None and now[name] != value}
        if not changed:
            break
        for name, value in changed.items():
            (as_float,) = struct.unpack("<f", value)
            station.mav.param_set_send(station.system, 1, name.encode(), as_float, GYRO_PARAMETERS[name])


@pytest.fixture
def gyro_kept(station: Any) -> Iterator[None]:
    """The calibration that the vehicle had; PX4 takes it from the parameters when they change."""
    before = gyro_parameters(station)
    yield
    give_back(station, before)


def test_nothing_to_calibrate_is_accepted(station: Any) -> None:
    assert calibrate(station, *NOTHING) == ACCEPTED


@pytest.mark.covers(
    "COMMAND_ACK", source="measured terminal/ground/calibrate_unknown: a sensor that there is not is unsupported"
)
def test_what_there_is_not(station: Any) -> None:
    assert calibrate(station, *(9,) * 7) == UNSUPPORTED


@pytest.mark.usefixtures("gyro_kept")
def test_a_gyro_at_rest_is_calibrated(station: Any) -> None:
    assert calibrate(station, *GYRO) == ACCEPTED
    texts = texts_until(station, "[cal] calibration done", 30.0)
    assert texts[0] == "[cal] calibration started: 2 gyro"
    assert texts[-1] == "[cal] calibration done: gyro"
    last_try = texts[max((i for i, text in enumerate(texts) if text == RETRYING), default=0) :]
    progress = [int(text.removeprefix(PROGRESS).rstrip(">")) for text in last_try if text.startswith(PROGRESS)]
    assert progress == sorted(progress)
    assert {0, 100} <= set(progress) <= set(range(0, 101, 10))


@pytest.mark.parametrize(
    ("params", "sensor"),
    [(ACCEL, "accel"), (MAG, "mag"), (AIRSPEED, "airspeed")],
)
def test_a_calibration_says_that_it_begins_and_is_cancelled(
    station: Any, params: tuple[float, ...], sensor: str
) -> None:
    assert calibrate(station, *params) == ACCEPTED
    started = f"[cal] calibration started: 2 {sensor}"
    assert texts_until(station, started, 10.0)[-1] == started
    assert station.heartbeat().system_status == CALIBRATING
    assert is_cancelled(station)


@pytest.mark.covers("MAV_CMD_PREFLIGHT_STORAGE", source="https://mavlink.io/en/messages/common.html#MAV_RESULT")
@pytest.mark.covers("MAV_CMD_FIXED_MAG_CAL_YAW", source="https://mavlink.io/en/messages/common.html#MAV_RESULT")
@pytest.mark.parametrize("command", [PREFLIGHT_STORAGE, FIXED_MAG_CAL_YAW])
def test_others_are_rejected_meanwhile(station: Any, command: int) -> None:
    assert calibrate(station, *ACCEL) == ACCEPTED
    assert station.command(command, 1) == TEMPORARILY_REJECTED


def test_an_accelerometer_waits_for_six_sides(station: Any) -> None:
    assert calibrate(station, *ACCEL) == ACCEPTED
    texts = texts_until(station, "[cal] hold vehicle still", 10.0)
    assert "[cal] pending: back front left right up down" in texts
    texts = texts_until(station, "[cal] down orientation detected", 30.0)
    assert texts[-1] == "[cal] down orientation detected"
