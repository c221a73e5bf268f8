"""UDP and TCP ports of PX4 SITL v1.18 for instance i (ROMFS/px4fmu_common/init.d-posix/px4-rc.mavlink), and video's."""

from typing import NamedTuple

GCS_REMOTE = 14550
MAX_OFFBOARD_REMOTE = 14549


class LinkPorts(NamedTuple):
    """One MAVLink link: the port the autopilot binds, and the port it sends to until somebody speaks."""

    local: int
    remote: int


def gcs(instance: int) -> LinkPorts:
    """Ground station: 18570+i → 14550."""
    return LinkPorts(18570 + instance, GCS_REMOTE)


def onboard(instance: int) -> LinkPorts:
    """Offboard API (MAVSDK, companion): 14580+i → 14540+i, and 14549 from the tenth instance on."""
    return LinkPorts(14580 + instance, min(14540 + instance, MAX_OFFBOARD_REMOTE))


def payload(instance: int) -> LinkPorts:
    """Onboard payload (slow): 14280+i → 14030+i."""
    return LinkPorts(14280 + instance, 14030 + instance)


def gimbal(instance: int) -> LinkPorts:
    """Gimbal: 13030+i → 13280+i."""
    return LinkPorts(13030 + instance, 13280 + instance)


def display(instance: int) -> LinkPorts:
    """What draws a simulated vehicle (PX4's Hawkeye): 19450+i → 19410+i; PX4 has it with its own simulation, SIH."""
    return LinkPorts(19450 + instance, 19410 + instance)


def video(instance: int) -> int:
    """UDP port on which a ground station hears a vehicle's video: 5600+i, as QGroundControl's default has it."""
    return 5600 + instance


def simulator(instance: int) -> int:
    """TCP port on which a simulator waits for the autopilot: 4560+i."""
    return 4560 + instance


def system_id(instance: int) -> int:
    """MAV_SYS_ID of an instance: i+1."""
    return instance + 1
