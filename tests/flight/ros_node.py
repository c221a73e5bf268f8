"""A ROS 2 node beside a vehicle in memory: it speaks and hears in samples, as DDS brings them."""

import math
from collections.abc import Iterator
from typing import Any

from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import PUBLICATIONS, SUBSCRIPTIONS, Sample

from .pilot import Pilot

SET_MODE, ARM, TAKEOFF, LAND = 176, 400, 22, 21
OFFBOARD_MODE = (1.0, 6.0)
"""DO_SET_MODE: custom mode enabled, PX4's OFFBOARD."""
FREE = (math.nan, math.nan, math.nan)
NUMBERS = {topic.name: number for number, topic in enumerate(SUBSCRIPTIONS)}
TYPES = {topic.name: topic.type for topic in SUBSCRIPTIONS}


class Node:
    """A ROS 2 node beside a vehicle in memory; its messages are stamped with its clock."""

    def __init__(self, pilot: Pilot) -> None:
        self.pilot = pilot
        self.client = pilot.autopilot.start_uxrce_dds_client()
        self.heard: list[tuple[str, dict[str, Any]]] = []

    def send(self, topic: str, **fields: Any) -> None:
        """One message of /fmu/in/TOPIC."""
        now_us = self.pilot.autopilot.now_us
        told = {"timestamp": now_us + self.client.time_offset_us, **fields}
        sample = Sample(NUMBERS[topic], cdr.Writer(TYPES[topic]).write(**told))
        self.client.on_sample(now_us, sample)

    def command(self, number: int, *params: float, target_system: int = 1) -> None:
        """A VehicleCommand, as PX4's offboard example sends it."""
        told = {f"param{place}": value for place, value in enumerate(params, 1)}
        who = {"target_component": 1, "source_system": 1, "source_component": 1, "from_external": True}
        self.send("vehicle_command", command=number, target_system=target_system, **who, **told)

    def hold(self, position: tuple[float, float, float]) -> None:
        """Position control, one beat of it."""
        self.send("offboard_control_mode", position=True)
        free = {"velocity": FREE, "acceleration": FREE, "jerk": FREE, "yawspeed": math.nan}
        self.send("trajectory_setpoint", position=position, yaw=0.0, **free)

    def hear(self, topic: str) -> Iterator[dict[str, Any]]:
        """What came on /fmu/out/TOPIC since the last time."""
        for number, data in self.client.outbox:
            self.heard.append((PUBLICATIONS[number].name, cdr.Reader(PUBLICATIONS[number].type).read(data)))
        self.client.outbox.clear()
        found = [fields for name, fields in self.heard if name == topic]
        self.heard = [each for each in self.heard if each[0] != topic]
        yield from found

    def acks(self) -> list[tuple[int, int]]:
        """Commands and results."""
        return [(ack["command"], ack["result"]) for ack in self.hear("vehicle_command_ack")]


def offboard(pilot: Pilot, node: Node, place: list[float], on: list[bool]) -> None:
    """Setpoints for a place that may be moved, at 10 Hz; armed in OFFBOARD, as in PX4's ROS 2 example."""

    def beat() -> None:
        if on[0]:
            north, east, down = place
            node.hold((north, east, down))

    pilot.until_armable()
    pilot.every(10.0, beat)
    pilot.run(1.0)
    node.command(SET_MODE, *OFFBOARD_MODE)
    node.command(ARM, 1.0)
