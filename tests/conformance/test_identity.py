"""Who is there: heartbeat, versions, modes, and how the vehicle is while it stands disarmed and ready."""

import struct
from typing import Any

import pytest

REQUEST_MESSAGE, ACCEPTED = 512, 0
AVAILABLE_MODES, CURRENT_MODE, PROTOCOL_VERSION = 435, 436, 300
HEADER_BYTES = 10
LOGGING = 0x1000000
"""MAV_SYS_STATUS_LOGGING, which comes and goes with the logger."""
V1_18 = 1 << 8 | 18
"""Major and minor version; patches do not change what is spoken."""
HOLD = 4 << 16 | 3 << 24
NOT_SELECTABLE = (2, 0, "(Mode not available)")
MODES = {
    1: (1 << 16, 1, 0, "Manual"),
    2: (2 << 16, 0, 4, ""),
    3: (3 << 16, 0, 1, ""),
    4: (4 << 16 | 4 << 24, 1, 6, ""),
    5: (4 << 16 | 3 << 24, 1, 0, "Hold"),
    6: (4 << 16 | 5 << 24, 1, 5, ""),
    7: (3 << 16 | 2 << 24, 1, 0, "Position Slow"),
    8: (4 << 16 | 19 << 24, 1, 0, "Guided Course"),
    9: (11 << 16, 1, 0, "Altitude Cruise"),
    10: (5 << 16, 1, 0, "Acro"),
    11: (10 << 16, 3, 0, "Termination"),
    12: (6 << 16, 1, 0, "Offboard"),
    13: (7 << 16, 1, 0, "Stabilized"),
    14: (4 << 16 | 2 << 24, 1, 8, ""),
    15: (4 << 16 | 6 << 24, 1, 7, ""),
    16: (4 << 16 | 8 << 24, 1, 0, "Follow Target"),
    17: (4 << 16 | 9 << 24, 1, 0, "Precision Landing"),
    18: (3 << 16 | 1 << 24, 1, 2, ""),
    19: (4 << 16 | 10 << 24, 1, 0, "VTOL Takeoff"),
    **{20 + number: (4 << 16 | (11 + number) << 24, *NOT_SELECTABLE) for number in range(8)},
}
"""By index: custom_mode, properties (1 advanced, 2 not selectable), standard_mode, name of what has no standard."""
PAGE = "https://mavlink.io/en/services/standard_modes.html"
MESSAGES = "https://mavlink.io/en/messages/common.html"

MULTICOPTER = pytest.mark.vehicle("MAV_TYPE_HEXAROTOR", "MAV_TYPE_QUADROTOR")
REFERENCE = pytest.mark.airframe(10044)
"""PX4's simulated hexacopter, on which these numbers were measured (identity/*)."""


def requested(station: Any, number: int, name: str, param2: float = 0.0) -> Any:
    """A message that REQUEST_MESSAGE brings, before its acknowledgement."""
    result, message = station.request(number, param2)
    assert (result, message.get_type()) == (ACCEPTED, name)
    return message


def body(message: Any, size: int) -> bytes:
    """The payload of a message that pymavlink's dialect does not know."""
    frame = bytes(message.data)
    return frame[HEADER_BYTES : HEADER_BYTES + frame[1]].ljust(size, b"\0")


def mode_of(message: Any) -> tuple[int, int, tuple[int, int, int, str]]:
    """Number of modes, index, and what MODES has of it."""
    custom_mode, properties, count, index, standard, name = struct.unpack("<IIBBB35s", body(message, 46))
    return count, index, (custom_mode, properties, standard, name.rstrip(b"\0").decode())


@pytest.mark.covers("HEARTBEAT", source=f"{MESSAGES}#HEARTBEAT")
@pytest.mark.covers(
    "HEARTBEAT", source="measured identity/heartbeat/gcs/*: in Hold: stabilised, guided, automatic; in standby"
)
def test_heartbeat(station: Any) -> None:
    beat = station.heartbeat()
    assert (beat.type, beat.autopilot, beat.mavlink_version) == (station.vehicle_type, 12, 3)
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (1 | 4 | 8 | 16, HOLD, 3)


@pytest.mark.covers(
    "AUTOPILOT_VERSION", source="measured identity/AUTOPILOT_VERSION/*: capabilities and versions of v1.18"
)
def test_version(station: Any) -> None:
    version = requested(station, 148, "AUTOPILOT_VERSION")
    assert version.capabilities == 59647
    assert version.flight_sw_version >> 16 == V1_18
    assert version.middleware_sw_version == version.flight_sw_version
    if not version.vendor_id:  # PX4's simulation, which is no board
        assert (version.board_version, version.product_id) == (1, 0)
    assert version.uid != 0
    assert any(version.uid2) or station.system == 1  # PX4's simulation has its system's number less one there


@pytest.mark.covers("PROTOCOL_VERSION", source="measured identity/PROTOCOL_VERSION: MAVLink 2, and 1.00 to 2.03")
def test_protocol_version(station: Any) -> None:
    message = requested(station, PROTOCOL_VERSION, f"UNKNOWN_{PROTOCOL_VERSION}")
    assert struct.unpack("<HHH", body(message, 22)[:6]) == (200, 100, 203)


@MULTICOPTER
@pytest.mark.covers("AVAILABLE_MODES", "MAV_CMD_REQUEST_MESSAGE", source=PAGE)
@pytest.mark.covers(
    "AVAILABLE_MODES",
    source="measured identity/AVAILABLE_MODES/*: 27 modes, eight of which are places for modes of others",
)
def test_all_modes_are_listed(station: Any) -> None:
    station.mav.command_long_send(station.system, 1, REQUEST_MESSAGE, 0, AVAILABLE_MODES, *(0.0,) * 6)
    listed = [mode_of(station.receive(f"UNKNOWN_{AVAILABLE_MODES}")) for _ in MODES]
    assert station.receive("COMMAND_ACK").result == 0
    assert {count for count, _, _ in listed} == {27}
    assert {index: mode for _, index, mode in listed} == MODES


@MULTICOPTER
@pytest.mark.covers("AVAILABLE_MODES", source=PAGE)
@pytest.mark.parametrize("index", [1, 2, 27])
def test_one_mode_is_told(station: Any, index: int) -> None:
    message = requested(station, AVAILABLE_MODES, f"UNKNOWN_{AVAILABLE_MODES}", index)
    assert mode_of(message) == (27, index, MODES[index])


@MULTICOPTER
@pytest.mark.covers(
    "MAV_CMD_REQUEST_MESSAGE",
    source="measured identity/AVAILABLE_MODES/*: MAV_RESULT_DENIED for a mode that is not there",
)
@pytest.mark.parametrize("index", [28, 200])
def test_a_mode_that_is_not_there_is_denied(station: Any, index: int) -> None:
    assert station.command(REQUEST_MESSAGE, AVAILABLE_MODES, index) == 2


@pytest.mark.covers(
    "CURRENT_MODE", source="measured identity/CURRENT_MODE: Hold, and nothing else is intended; no standard mode"
)
def test_current_mode(station: Any) -> None:
    message = requested(station, CURRENT_MODE, f"UNKNOWN_{CURRENT_MODE}")
    assert struct.unpack("<IIB", body(message, 9)) == (HOLD, HOLD, 0)


@REFERENCE
@pytest.mark.covers(
    "SYS_STATUS", source="measured identity/SYS_STATUS/*: sensors of the simulated hexacopter, a full battery of 16.2 V"
)
def test_system_status(station: Any) -> None:
    status = requested(station, 1, "SYS_STATUS")
    assert status.onboard_control_sensors_present | LOGGING == 50380847
    assert status.onboard_control_sensors_enabled | LOGGING == 50446383
    assert status.onboard_control_sensors_health | LOGGING == 320915519
    assert status.battery_remaining == pytest.approx(100, abs=2)
    assert status.voltage_battery == pytest.approx(16200, rel=0.03)


@pytest.mark.covers("EXTENDED_SYS_STATE", source="measured identity/EXTENDED_SYS_STATE: on the ground, no VTOL")
def test_landed_state(station: Any) -> None:
    state = requested(station, 245, "EXTENDED_SYS_STATE")
    assert (state.landed_state, state.vtol_state) == (1, 0)


@REFERENCE
@pytest.mark.covers("GPS_RAW_INT", source="measured identity/GPS_RAW_INT: a 3D fix by ten satellites")
def test_satellites(station: Any) -> None:
    fix = station.receive("GPS_RAW_INT")
    assert (fix.fix_type, fix.satellites_visible, fix.eph, fix.epv) == (3, 10, 70, 110)
    assert (fix.h_acc, fix.v_acc, fix.vel_acc) == (900, 1780, 400)


@REFERENCE
@pytest.mark.covers(
    "BATTERY_STATUS", source="measured identity/BATTERY_STATUS: battery 0, for all of the vehicle, of lithium polymer"
)
def test_battery(station: Any) -> None:
    battery = requested(station, 147, "BATTERY_STATUS")
    assert (battery.id, battery.battery_function, battery.type, battery.charge_state) == (0, 1, 1, 1)
    assert (battery.temperature, battery.energy_consumed, battery.fault_bitmask) == (32767, -1, 0)


@pytest.mark.covers("HOME_POSITION", "GLOBAL_POSITION_INT", "GPS_GLOBAL_ORIGIN", source=f"{MESSAGES}#HOME_POSITION")
def test_home_is_where_the_vehicle_stands(station: Any) -> None:
    home = requested(station, 242, "HOME_POSITION")
    position = requested(station, 33, "GLOBAL_POSITION_INT")
    origin = requested(station, 49, "GPS_GLOBAL_ORIGIN")
    assert abs(home.latitude - position.lat) < 300
    assert abs(home.longitude - position.lon) < 300
    assert abs(home.altitude - position.alt) < 5000
    assert abs(origin.latitude - home.latitude) < 3000
