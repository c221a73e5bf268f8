"""The ground station's half of a calibration, against a worker that calibrates, and against what can go wrong."""

from typing import Any

import pytest

from sitl_emu.core import dialect as mavlink
from sitl_emu.gcs.actuator_test import stop_motor, turn_motor
from sitl_emu.gcs.calibration import Calibration
from sitl_emu.gcs.command import gripper
from sitl_emu.gcs.failure_injection import inject_failure
from sitl_emu.gcs.statustext import messages_of
from tests.unit.companion_px4 import on_the_wire
from tests.unit.test_calibration import FORCES, Table

STEP_S = 0.1


class Link:
    """A calibration of the ground station and a table with a worker, and what passes between."""

    def __init__(self, sensor: str) -> None:
        self.table = Table()
        self.calibration = Calibration(1, sensor)

    def hear(self, message: Any) -> None:
        self.calibration.on_message(self.table.now_us, on_the_wire(message, 1, 1))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            for message in self.calibration.on_time(self.table.now_us):
                result = self.table.command(*(getattr(message, f"param{n}") for n in range(1, 8)))
                if result is not None:
                    self.hear(mavlink.MAVLink_command_ack_message(message.command, result))
            self.table.run(STEP_S)
            for text in self.table.said:
                for message in messages_of(text, 6, 1):
                    self.hear(message)
            self.table.said.clear()


def test_a_gyro() -> None:
    link = Link("gyro")
    link.run(0.6)
    assert 20 < link.calibration.progress_percent < 80
    assert not link.calibration.done
    link.run(2.0)
    assert link.calibration.succeeded and link.calibration.progress_percent == 100


def test_an_accelerometer_tells_what_to_do() -> None:
    link = Link("accel")
    link.run(3.0)
    assert link.calibration.pending == ("back", "front", "left", "right", "up", "down")
    assert "hold still" in link.calibration.instruction
    link.run(2.5)
    assert link.calibration.side == "down"
    link.run(4.0)
    assert "down" not in link.calibration.pending and link.calibration.progress_percent == 17
    for force in FORCES.values():
        link.table.accel = lambda t, force=force: force  # type: ignore[misc]
        link.run(9.0)
    assert link.calibration.succeeded


def test_it_is_cancelled() -> None:
    link = Link("mag")
    link.run(4.0)  # the side is told by then: PX4 misses who cancels before
    link.calibration.cancel()
    link.run(2.0)
    assert (link.calibration.succeeded, link.calibration.text) == (False, "cancelled")
    assert not link.table.worker.busy


def test_who_cancels_between_two_parts_is_heard_the_next_time() -> None:
    """PX4 looks for who cancels since a part began: the rest on a side is before that of its turning."""
    link = Link("mag")
    link.run(1.0)
    link.calibration.cancel()
    link.run(6.0)
    assert (link.calibration.succeeded, link.calibration.text) == (False, "cancelled")


def test_it_fails_as_the_autopilot_says() -> None:
    link = Link("baro")
    link.run(4.0)
    assert (link.calibration.succeeded, link.calibration.text) == (False, "GPS required for baro cal")


def test_it_is_refused() -> None:
    link = Link("gyro")
    link.table.command(0, 0, 0, 0, 1)
    link.run(0.5)
    assert (link.calibration.succeeded, link.calibration.text) == (False, "temporarily rejected")


def test_an_autopilot_that_falls_silent() -> None:
    link = Link("gyro")
    link.run(0.2)
    assert link.calibration.on_time(link.table.now_us + 61_000_000) == []
    assert (link.calibration.succeeded, link.calibration.text) == (False, "the autopilot says nothing more")
    link.calibration.cancel()
    assert link.calibration.on_time(link.table.now_us + 62_000_000) == []


def test_a_sensor_that_there_is_not() -> None:
    with pytest.raises(KeyError):
        Calibration(1, "nose")


def test_commands_of_the_workshop() -> None:
    assert (turn_motor(1, 3, 0.1, 2.0).command, turn_motor(1, 3, 0.1, 2.0).params) == (310, (0.1, 2.0, 0, 0, 3, 0, 0))
    assert stop_motor(1, 3).params[1:5] == (0, 0, 0, 3)
    assert (inject_failure(1, 4, 1).command, inject_failure(1, 4, 1).params[:3]) == (420, (4, 1, 0))
    assert (gripper(1, open_it=True).command, gripper(1, open_it=False).params[1]) == (211, 1)
