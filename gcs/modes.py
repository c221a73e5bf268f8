"""PX4's flight modes by name, as they stand in HEARTBEAT.custom_mode (main << 16 | sub << 24), PX4 v1.18.

Source: PX4's px4_custom_mode.h as seen on the wire; names are QGroundControl's and MAVSDK's, lower-cased.
"""

MODES: dict[str, tuple[int, int]] = {
    "manual": (1, 0),
    "altitude": (2, 0),
    "position": (3, 0),
    "orbit": (3, 1),
    "position_slow": (3, 2),
    "takeoff": (4, 2),
    "hold": (4, 3),
    "mission": (4, 4),
    "return": (4, 5),
    "land": (4, 6),
    "follow_me": (4, 8),
    "precision_land": (4, 9),
    "vtol_takeoff": (4, 10),
    "acro": (5, 0),
    "offboard": (6, 0),
    "stabilized": (7, 0),
    "termination": (10, 0),
    "altitude_cruise": (11, 0),
}
_NAMES = {main << 16 | sub << 24: name for name, (main, sub) in MODES.items()}


def name_of(custom_mode: int) -> str:
    """Name of a custom mode; "main.sub" in numbers if it is none that we know."""
    return _NAMES.get(custom_mode) or f"{custom_mode >> 16 & 0xFF}.{custom_mode >> 24 & 0xFF}"
