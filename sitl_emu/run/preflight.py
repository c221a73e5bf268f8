"""What is seen to keep a run from starting, while nothing has been written yet: too many vehicles, ports, programs."""

import errno
import shutil
import socket
import sys

from sitl_emu.core import ports
from sitl_emu.run import video_sender
from sitl_emu.run.scenario import Scenario
from sitl_emu.run.trouble import Trouble
from sitl_emu.run.wiring import has_video

LOOPBACK = "127.0.0.1"
LAST_INSTANCE = 249
"""Its system id is 250, PX4's largest."""
MAX_OWN_OFFBOARD = 8
"""The last instance whose offboard port no other has."""


def check(scenario: Scenario, first_instance: int, *, isolated: bool = False) -> None:
    """Raise Trouble for the first thing that is in the way; `isolated`: as in `wiring.Wanted`."""
    last = first_instance + len(scenario.vehicles) - 1
    if last > LAST_INSTANCE:
        raise Trouble(
            f"the last of {len(scenario.vehicles)} vehicles would be instance {last}, but instances end at "
            f"{LAST_INSTANCE}, as PX4's system ids do at {ports.system_id(LAST_INSTANCE)}: choose a smaller --instance"
        )
    for vehicle in scenario.vehicles:
        for what, command in (
            ("autopilot", vehicle.autopilot.command if vehicle.autopilot is not None else None),
            ("companion", vehicle.companion.command if vehicle.companion is not None else None),
        ):
            program = command[0].replace("{python}", sys.executable) if command is not None else None
            if program is not None and shutil.which(program) is None:
                raise Trouble(f"{what} {vehicle.name}: can't start {program!r}: there is no such program")
    if isolated:
        _check_isolation(scenario)
        return
    _check_sharing(scenario, first_instance)
    _check_ports(scenario, first_instance)


def _check_isolation(scenario: Scenario) -> None:
    """Raise Trouble for what needs PX4's ports to find its vehicle."""
    for vehicle in scenario.vehicles:
        for what, part in (("autopilot", vehicle.autopilot), ("companion", vehicle.companion)):
            if part is not None and part.command is not None:
                raise Trouble(
                    f"--isolated: the {what} of {vehicle.name} is a command, which finds its vehicle by PX4's ports; "
                    "run without it"
                )


def check_video(scenario: Scenario) -> None:
    """Raise Trouble where no video can be sent."""
    if not any(has_video(vehicle) for vehicle in scenario.vehicles):
        raise Trouble(
            f"--video: no vehicle of {scenario.name} has a camera; give one of them `camera: {{}}`, or, where its "
            "autopilot is not ours, `components: true` as well"
        )
    video_sender.check()


def _check_sharing(scenario: Scenario, first_instance: int) -> None:
    """Raise Trouble where two companions would listen on one port."""
    of_companions = dict[int, str]()
    for instance, vehicle in enumerate(scenario.vehicles, first_instance):
        if vehicle.companion is None or "{connect}" not in "".join(vehicle.companion.command or ["{connect}"]):
            continue
        port = ports.onboard(instance).remote
        if port in of_companions:
            raise Trouble(
                f"the companions of {of_companions[port]} and {vehicle.name} would share UDP port {port}, as PX4 "
                f"gives it to all instances above {MAX_OWN_OFFBOARD}: choose a smaller --instance"
            )
        of_companions[port] = vehicle.name


def _check_ports(scenario: Scenario, first_instance: int) -> None:
    """Raise Trouble naming the first port in use, who needs it and what to do about it."""
    for instance, vehicle in enumerate(scenario.vehicles, first_instance):
        needed = [
            (socket.SOCK_DGRAM, "0.0.0.0", ports.gcs(instance).local, "ground station link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.onboard(instance).local, "offboard link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.payload(instance).local, "payload link"),
            (socket.SOCK_DGRAM, "0.0.0.0", ports.gimbal(instance).local, "gimbal link"),
            (socket.SOCK_STREAM, LOOPBACK, ports.simulator(instance), "simulator"),
        ]
        if vehicle.companion is not None and vehicle.companion.mission is not None:
            needed.append((socket.SOCK_DGRAM, LOOPBACK, ports.onboard(instance).remote, "companion"))
        if vehicle.tells_obstacles:
            needed.append((socket.SOCK_DGRAM, LOOPBACK, ports.payload(instance).remote, "depth camera or lidar"))
        for kind, address, port, user in needed:
            with socket.socket(socket.AF_INET, kind) as tried:
                if kind == socket.SOCK_STREAM:
                    tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                try:
                    tried.bind((address, port))
                except OSError as error:
                    if error.errno != errno.EADDRINUSE:
                        raise
                    name = "UDP" if kind == socket.SOCK_DGRAM else "TCP"
                    raise Trouble(
                        f"{name} port {port}, which the {user} of vehicle {vehicle.name} (instance {instance}) needs, "
                        f"is in use: end the program that holds it (`ss -lpn 'sport = :{port}'` tells which), "
                        "or start this run with another --instance"
                    ) from None
