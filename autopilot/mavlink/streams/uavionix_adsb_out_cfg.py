"""UAVIONIX_ADSB_OUT_CFG: what a transponder is to say of the aircraft (PX4: streams/UAVIONIX_ADSB_OUT_CFG.hpp).

ADSB_ICAO_ID, ADSB_EMIT_TYPE, ADSB_LEN_WIDTH, ADSB_GPS_OFF_LAT, ADSB_GPS_OFF_LON, FW_AIRSPD_STALL, and the callsign of
ADSB_CALLSIGN_1 and ADSB_CALLSIGN_2, four letters each.
"""

from typing import Final

from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import product, truncated

ID = mavlink.MAVLINK_MSG_ID_UAVIONIX_ADSB_OUT_CFG
TX_ENABLED: Final = 2
"""UAVIONIX_ADSB_OUT_RF_SELECT_TX_ENABLED."""
LETTERS: Final = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 \0"
NO_CALLSIGN: Final = b""
"""Of one with another letter (copy_and_check_callsign)."""


def fields(now_us: int, context: Context) -> Fields:
    """Whenever it is asked for."""
    parameters = context.parameters
    parts = [int(parameters[name]) & 0xFFFFFFFF for name in ("ADSB_CALLSIGN_1", "ADSB_CALLSIGN_2")]
    callsign = b"".join(part.to_bytes(4, "big") for part in parts)
    return (
        int(parameters["ADSB_ICAO_ID"]),
        truncated(product(float(parameters["FW_AIRSPD_STALL"]), 100.0)),
        callsign if all(letter in LETTERS for letter in callsign) else NO_CALLSIGN,
        int(parameters["ADSB_EMIT_TYPE"]),
        int(parameters["ADSB_LEN_WIDTH"]),
        int(parameters["ADSB_GPS_OFF_LAT"]),
        int(parameters["ADSB_GPS_OFF_LON"]),
        TX_ENABLED,
    )
