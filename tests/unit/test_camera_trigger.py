"""The camera trigger by itself: what it makes of commands, and when it takes images (PX4: drivers/camera_trigger)."""

import itertools
import math

import pytest

from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import MAV_RESULT_ACCEPTED, MAV_RESULT_TEMPORARILY_REJECTED
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.payload.camera_trigger import CameraTrigger
from sitl_emu.autopilot.topics import Topics, VehicleCommand, VehicleLocalPosition
from sitl_emu.autopilot.vehicle_kind import VehicleKind

TICK_US = 4_000
RUN_TICKS = 13
"""Of a tick of 4 ms each: the first that is 50 ms after the last run."""
DIGICAM, DISTANCE, INTERVAL, CONTROL, OBLIQUE, MOUNT_CONTROL = 203, 206, 214, 2003, 260, 205


class Trigger:
    """A camera trigger and nothing else; it moves north as it is told."""

    def __init__(self, mode: int, **parameters: float) -> None:
        self.parameters = Parameters(VehicleKind.MULTICOPTER, {"TRIG_MODE": mode, **parameters})
        self.topics = Topics()
        self.outgoing = OutgoingCommands()
        self.module = CameraTrigger(self.topics, self.parameters, self.outgoing)
        self.now_us = 0
        self.north_m = 0.0
        self.speed_m_s = 0.0
        self.images: list[int] = []
        """When each was taken, in us."""
        self.places: list[float] = []

    def give(self, command: int, *params: float) -> None:
        """By somebody outside; what is not given is NaN."""
        p1, p2, p3, p4, p5, p6, p7 = (*params, *(math.nan,) * (7 - len(params)))
        given = VehicleCommand(command, p1, p2, p3, p4, p5, p6, p7)
        assert self.module.handle_command(self.now_us, given) is None, "answered later"

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self.now_us += TICK_US
            self.north_m += self.speed_m_s * TICK_US * 1e-6
            self.topics.vehicle_local_position = VehicleLocalPosition(self.now_us, xy_valid=True, x=self.north_m, y=0.0)
            self.module.update(self.now_us)
            if self.topics.camera_trigger.timestamp == self.now_us:
                self.images.append(self.now_us)
                self.places.append(self.north_m)

    def take_images(self) -> list[int]:
        """Those since the last call."""
        images, self.images, self.places = self.images, [], []
        return images

    def answers(self) -> list[tuple[int, int]]:
        """Commands and results since the last call."""
        acks, self.topics.vehicle_command_acks = self.topics.vehicle_command_acks, ()
        return [(ack.command.command, ack.result) for ack in acks]


def test_a_distance_is_counted_anew_from_each_command_that_gives_one() -> None:
    trigger = Trigger(4)
    trigger.speed_m_s = 10.0
    for _ in range(2):
        trigger.give(DISTANCE, 100.0)
        trigger.run(1.0)
        assert len(trigger.take_images()) == 1, "at once, though it was on already"


@pytest.mark.parametrize("mode", [3, 4])
def test_a_distance_is_counted_anew_after_a_pause(mode: int) -> None:
    trigger = Trigger(mode)
    trigger.give(CONTROL, 1.0, math.nan, 0.0)
    trigger.run(1.0)
    assert len(trigger.take_images()) == 1
    trigger.give(CONTROL, -1.0, math.nan, 1.0)
    trigger.run(1.0)
    assert trigger.take_images() == []
    trigger.give(CONTROL, -1.0, math.nan, 0.0)
    trigger.run(1.0)
    assert len(trigger.take_images()) == 1


def test_a_distance_is_looked_at_twenty_times_a_second() -> None:
    trigger = Trigger(4)
    trigger.speed_m_s = 25.0
    trigger.give(DISTANCE, 5.0)
    trigger.run(3.0)
    ticks = [image // TICK_US for image in trigger.images]
    assert len(ticks) == 15
    assert {tick % RUN_TICKS for tick in ticks} == {1}


def test_commands_are_taken_and_answered_one_a_run_and_eight_wait() -> None:
    trigger = Trigger(1)
    trigger.run(0.06)
    for _ in range(10):
        trigger.give(DIGICAM, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert trigger.answers() == []
    trigger.run(1.0)
    assert trigger.answers() == [(DIGICAM, MAV_RESULT_ACCEPTED)] * 8
    taken = trigger.take_images()
    assert [later - earlier for earlier, later in itertools.pairwise(taken)] == [RUN_TICKS * TICK_US] * 7


def test_a_single_image_too_soon_after_another_is_rejected_for_now() -> None:
    trigger = Trigger(1, TRIG_MIN_INTERVA=500.0)
    trigger.run(1.0)
    for _ in range(2):
        trigger.give(DIGICAM, 0.0, 0.0, 0.0, 0.0, 1.0)
        trigger.run(0.1)
    assert trigger.answers() == [(DIGICAM, MAV_RESULT_ACCEPTED), (DIGICAM, MAV_RESULT_TEMPORARILY_REJECTED)]
    assert len(trigger.take_images()) == 1
    trigger.run(0.5)
    trigger.give(DIGICAM, 0.0, 0.0, 0.0, 0.0, 1.0)
    trigger.run(0.1)
    assert trigger.answers() == [(DIGICAM, MAV_RESULT_ACCEPTED)]


def test_a_series_counts_from_planned_times() -> None:
    """13 ms are no whole number of ticks, and its images no later for that."""
    trigger = Trigger(1, TRIG_INTERVAL=13.0)
    trigger.give(CONTROL, 1.0)
    trigger.run(1.3)
    first = trigger.images[0]
    planned = [first + 13_000 * number for number in range(len(trigger.images))]
    assert len(planned) == 100
    assert trigger.images == [-(-time // TICK_US) * TICK_US for time in planned]


def test_a_new_interval_is_for_the_next_series() -> None:
    trigger = Trigger(1, TRIG_INTERVAL=200.0)
    trigger.give(CONTROL, 1.0)
    trigger.run(1.0)
    trigger.take_images()
    trigger.give(INTERVAL, 40.0)
    trigger.give(CONTROL, 1.0)
    trigger.run(1.0)
    assert len(trigger.take_images()) == 5
    trigger.give(CONTROL, 0.0)
    trigger.give(CONTROL, 1.0)
    trigger.run(1.1)
    assert len(trigger.take_images()) > 20


def test_a_series_from_the_start_does_not_come_back_after_a_pause() -> None:
    trigger = Trigger(2)
    trigger.run(1.0)
    assert len(trigger.take_images()) == 26
    trigger.give(CONTROL, -1.0, math.nan, 1.0)
    trigger.run(0.1)
    trigger.take_images()
    trigger.give(CONTROL, -1.0, math.nan, 0.0)
    trigger.run(1.0)
    assert trigger.take_images() == []


@pytest.mark.parametrize("mode", [1, 2])
def test_a_single_image_ends_a_series(mode: int) -> None:
    trigger = Trigger(mode)
    trigger.give(CONTROL, 1.0)
    trigger.run(1.0)
    assert trigger.take_images()
    trigger.give(DIGICAM, 0.0, 0.0, 0.0, 0.0, 1.0)
    trigger.run(0.1)
    trigger.take_images()
    trigger.run(1.0)
    assert trigger.take_images() == []


def test_what_commands_set_is_kept_in_the_parameters_and_nobody_is_told() -> None:
    trigger = Trigger(4)
    told = trigger.parameters.notifications
    trigger.give(DISTANCE, 7.5)
    trigger.give(INTERVAL, 250.0)
    trigger.run(0.2)
    assert (trigger.parameters["TRIG_DISTANCE"], trigger.parameters["TRIG_INTERVAL"]) == (7.5, 250.0)
    assert trigger.parameters.notifications == told
    assert {"TRIG_DISTANCE", "TRIG_INTERVAL"} <= trigger.parameters.unsaved


def test_its_parameters_are_announced_once_it_has_started_also_where_a_saved_value_has_it_start() -> None:
    parameters = Parameters(VehicleKind.MULTICOPTER)
    assert "TRIG_DISTANCE" not in parameters.announced
    parameters.load({"TRIG_MODE": 4})
    CameraTrigger(Topics(), parameters, OutgoingCommands())
    assert {"TRIG_ACT_TIME", "TRIG_DISTANCE", "TRIG_INTERVAL", "TRIG_MIN_INTERVA"} <= set(parameters.announced)


def test_numbers_are_rounded() -> None:
    trigger = Trigger(1)
    trigger.give(CONTROL, 0.5, math.nan, -0.4)
    trigger.run(0.1)
    assert (trigger.module.enabled, trigger.module.paused) == (True, False)
    trigger.give(CONTROL, math.nan, math.nan, 0.6)
    trigger.run(0.1)
    assert (trigger.module.enabled, trigger.module.paused) == (True, True)


def test_an_oblique_survey_rolls_the_gimbal_between_images() -> None:
    """adjust_roll: the pose after the first comes first, at once; the others once an image may be taken again."""
    trigger = Trigger(4, MAV_SYS_ID=7)
    trigger.speed_m_s = 10.0
    trigger.module.handle_command(
        0, VehicleCommand(OBLIQUE, 5.0, 0.0, 200.0, 3.0, 30.0, -60.0, 0.0, target_system=7, target_component=1)
    )
    trigger.run(0.1)
    assert trigger.answers() == [(OBLIQUE, MAV_RESULT_ACCEPTED)]
    assert trigger.parameters["TRIG_MIN_INTERVA"] == 200.0
    trigger.run(1.9)
    assert len(trigger.images) == 4
    given = trigger.outgoing.waiting
    assert [(each.param1, each.param2, each.param7) for each in given] == [
        (-60.0, 0.0, 2.0), (-60.0, 30.0, 2.0), (-60.0, -30.0, 2.0), (-60.0, 0.0, 2.0),
    ]  # fmt: skip
    assert {(each.command, each.target_system, each.target_component) for each in given} == {(MOUNT_CONTROL, 7, 1)}
    assert [record.command for record in trigger.topics.navigator_commands] == given
    trigger.give(OBLIQUE, 5.0, 0.0, 0.0, 1.0)
    trigger.run(2.0)
    assert len(trigger.outgoing.waiting) == 4, "one pose is none"
