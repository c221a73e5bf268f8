"""The component that tells an autopilot of obstacles: its heartbeat, and OBSTACLE_DISTANCE as that reads it."""

from sitl_emu.autopilot.mavlink.services.obstacle_distance import obstacles
from sitl_emu.components.obstacle_detector import ObstacleDetector
from sitl_emu.core import dialect as mavlink


def test_what_it_tells_arrives() -> None:
    detector = ObstacleDetector(7)
    detector.on_time(960_000)
    distances = tuple(range(100, 172))
    detector.tell(950_000, mavlink.MAV_DISTANCE_SENSOR_LASER, distances, 50, 4000)
    decoder = mavlink.MAVLink(None)
    heartbeat, told = (decoder.decode(bytearray(datagram)) for datagram in detector.outbox)
    assert (heartbeat.get_srcSystem(), heartbeat.get_srcComponent(), heartbeat.type) == (7, 196, 18)
    assert told.time_usec == 950_000 and told.sensor_type == 0
    taken = obstacles(1_000_000, told)
    assert taken.distances == distances and (taken.frame, taken.increment, taken.angle_offset) == (12, 5.0, 0.0)
    assert (taken.min_distance, taken.max_distance) == (50, 4000)
