"""What goes out: from which of our topics, by which row of the logger's, as a message on the wire.

All topics that PX4's client publishes are declared to DDS; those that no record of ours fills stay silent, as most of
them do in PX4, too, where nothing asks for them.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

from sitl_emu.autopilot.logger.logged_topics import LoggedTopic
from sitl_emu.autopilot.logger.packing import Row
from sitl_emu.autopilot.topics import (
    FRAME_NED,
    GimbalDeviceAttitudeStatus,
    Topics,
    VehicleLocalPosition,
)
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import PUBLICATIONS, Topic
from sitl_emu.core.attitude import variances_about_body

TOLD_ELSEWHERE = frozenset({"timesync_status"})
"""The client tells of its own clock (uxrce_dds_client.py)."""
NUMBERS = {topic.name: number for number, topic in enumerate(PUBLICATIONS)}
"""By topic, its place in the table: the number by which DDS's side knows it."""


class Publication(NamedTuple):
    """A topic that is published."""

    number: int
    interval_us: int
    source: str
    """Name of our topic."""
    pack: Row
    """The message on the wire, of one of our records."""
    state: bool = False
    """Its writer may repeat it all the time: it goes out when it has changed, and twice a second."""


def publications(logged: Iterable[LoggedTopic], topics: Topics, system_id: int) -> list[Publication]:
    """All that we can fill, of what the logger can log of this vehicle (`Logger.topics`)."""
    rows = {each.name: each for each in logged if each.instance == 0 and each.name not in TOLD_ELSEWHERE}
    found = [
        _publication(topic, rows[topic.name].source, _from_log(topic, rows[topic.name].row), rows[topic.name].state)
        for topic in PUBLICATIONS
        if topic.name in rows
    ]
    known = {topic.name: topic for topic in PUBLICATIONS}
    found.append(_publication(known["vehicle_odometry"], "vehicle_local_position", _odometry(topics)))
    gimbal = known["gimbal_device_attitude_status"]
    found.append(_publication(gimbal, gimbal.name, _gimbal_device_attitude_status(system_id)))
    return found


def _publication(topic: Topic, source: str, pack: Row, state: bool = False) -> Publication:
    return Publication(NUMBERS[topic.name], topic.interval_us, source, pack, state)


def _from_log(topic: Topic, row: Row) -> Row:
    rearranged = cdr.from_log(topic.type, topic.name)
    return lambda record: rearranged(row(record))


def from_row(name: str, row: Row) -> Row:
    """A topic that has a row in the logger, and no record of its own there."""
    return _from_log(PUBLICATIONS[NUMBERS[name]], row)


def _odometry(topics: Topics) -> Row:
    """Pose and velocity in NED, with the body's rates (PX4: EKF2::PublishOdometry)."""
    write = cdr.Packer("VehicleOdometry")

    def pack(here: VehicleLocalPosition) -> bytes:
        attitude = topics.vehicle_attitude
        variances = topics.odometry_variances
        resets = here.xy_reset_counter + here.z_reset_counter + here.vxy_reset_counter + here.vz_reset_counter
        return write.pack(
            here.timestamp,
            here.timestamp_sample,
            FRAME_NED,
            *(here.x, here.y, here.z),
            *attitude.q,
            FRAME_NED,
            *(here.vx, here.vy, here.vz),
            *topics.vehicle_angular_velocity.xyz,
            *variances.position,
            *variances_about_body(attitude.q, variances.attitude),
            *variances.velocity,
            (resets + attitude.quat_reset_counter) & 255,
            0,
        )

    return pack


def _gimbal_device_attitude_status(system_id: int) -> Row:
    """What a gimbal device said, as mavlink_receiver.cpp publishes it; of its rates and failures nothing is known."""
    writer = cdr.Writer("GimbalDeviceAttitudeStatus")

    def pack(record: GimbalDeviceAttitudeStatus) -> bytes:
        fields: dict[str, Any] = {
            "timestamp": record.timestamp,
            "target_system": system_id,
            "device_flags": record.device_flags,
            "q": record.q,
            "received_from_mavlink": True,
        }
        return writer.write(**fields)

    return pack
