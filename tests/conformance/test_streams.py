"""What comes by itself to a ground station, and how often, in the vehicle's own time."""

import time
from collections import Counter
from typing import Any

import pytest
from pymavlink.dialects.v20 import common

SECONDS, LIMIT_S = 10.0, 60.0
"""Of the vehicle's time, and of ours: a slow machine must not count less often what comes every 3 s."""
SLOWEST_HZ = 0.25
"""What is slower (VIBRATION, every ten seconds) may be missed in so short a time."""
AUTOPILOT = 1
COMPONENT_BYTE = 6
"""Of a MAVLink 2 frame."""
RATES_HZ = {
    "ALTITUDE": 1.0,
    "ATTITUDE": 50.0,
    "ATTITUDE_QUATERNION": 50.0,
    "ATTITUDE_TARGET": 50.0,
    "BATTERY_STATUS": 0.5,
    "CURRENT_EVENT_SEQUENCE": 0.34,
    "CURRENT_MODE": 0.5,
    "DISTANCE_SENSOR": 0.5,
    "ESC_INFO": 2.0,
    "ESC_STATUS": 2.0,
    "ESTIMATOR_SENSOR_FUSION_STATUS": 0.5,
    "ESTIMATOR_STATUS": 0.5,
    "EXTENDED_SYS_STATE": 1.0,
    "GLOBAL_POSITION_INT": 50.0,
    "GNSS_INTEGRITY": 1.0,
    "GPS_RAW_INT": 5.0,
    "HEARTBEAT": 1.0,
    "HOME_POSITION": 0.5,
    "LINK_NODE_STATUS": 1.0,
    "LOCAL_POSITION_NED": 50.0,
    "MISSION_CURRENT": 1.0,
    "OPEN_DRONE_ID_LOCATION": 1.0,
    "OPEN_DRONE_ID_SYSTEM": 1.0,
    "POSITION_TARGET_LOCAL_NED": 50.0,
    "SCALED_PRESSURE": 1.0,
    "SERVO_OUTPUT_RAW": 50.0,
    "SYS_STATUS": 1.0,
    "TIME_ESTIMATE_TO_TARGET": 0.5,
    "VFR_HUD": 4.0,
}
"""A multicopter that stands disarmed."""
PARTS = {"ESC_INFO": 2, "ESC_STATUS": 2}
"""Four ESCs a message, six rotors: their rates are those of the hexacopter."""
NOT_STREAMS = {"EVENT", "STATUSTEXT", "PING", "PARAM_VALUE", "COMMAND_ACK", "TIMESYNC"}
NAMES = {
    "UNKNOWN_8": "LINK_NODE_STATUS",
    "UNKNOWN_290": "ESC_INFO",
    "UNKNOWN_291": "ESC_STATUS",
    "UNKNOWN_380": "TIME_ESTIMATE_TO_TARGET",
    "UNKNOWN_410": "EVENT",
    "UNKNOWN_411": "CURRENT_EVENT_SEQUENCE",
    "UNKNOWN_436": "CURRENT_MODE",
    "UNKNOWN_441": "GNSS_INTEGRITY",
    "UNKNOWN_514": "ESTIMATOR_SENSOR_FUSION_STATUS",
}
"""Of messages that pymavlink's packaged dialects do not know."""

pytestmark = pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")


def name_of(message: Any) -> str | None:
    """The message's name if the autopilot sent it."""
    name = str(message.get_type())
    component = message.data[COMPONENT_BYTE] if name.startswith("UNKNOWN") else message.get_srcComponent()
    return NAMES.get(name, name) if component == AUTOPILOT else None


@pytest.fixture(scope="module")
def rates_hz(station: Any) -> dict[str, float]:
    """Rates by name, over ten seconds of vehicle time."""
    counts: Counter[str] = Counter()
    times_ms: list[int] = []
    end_s = time.monotonic() + LIMIT_S
    station.heartbeat()
    while not times_ms or times_ms[-1] - times_ms[0] < SECONDS * 1000.0:
        assert time.monotonic() < end_s, f"{SECONDS:.0f} s of the vehicle take more than {LIMIT_S:.0f} s"
        message = station.receive(None, 0.1)
        name = None if message is None else name_of(message)
        if name is not None:
            counts[name] += 1
            if message.get_msgId() == common.MAVLINK_MSG_ID_ATTITUDE:
                times_ms.append(message.time_boot_ms)
    seconds = (times_ms[-1] - times_ms[0]) / 1000.0
    found = {name: count / seconds for name, count in counts.items() if name not in NOT_STREAMS}
    return {name: hz for name, hz in found.items() if hz > SLOWEST_HZ}


@pytest.mark.airframe(10044)
@pytest.mark.covers(
    *RATES_HZ, source="measured stream/gcs/disarmed/*: what PX4 streams to a ground station, and no more"
)
def test_these_messages_are_streamed(rates_hz: dict[str, float]) -> None:
    assert set(rates_hz) == set(RATES_HZ)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.covers(name, source=f"measured stream/gcs/disarmed/{name}: its rate"))
        for name in RATES_HZ
    ],
)
def test_rate(station: Any, rates_hz: dict[str, float], name: str) -> None:
    if station.airframe != 10044 and (name in PARTS or name not in rates_hz):
        pytest.skip("this vehicle may have other sensors and rotors")
    assert rates_hz[name] == pytest.approx(RATES_HZ[name], rel=0.15, abs=0.35 * PARTS.get(name, 1))
