"""How long parts of a return take at the vehicle's own speeds. PX4's RtlTimeEstimator (src/lib/rtl, v1.18)."""

from sitl_emu.autopilot.navigator.state import Settings

SLOWEST_M_S = 0.1
"""Below this a speed is none, and would make a return endless; ours."""


def vertical_s(settings: Settings, climb_m: float) -> float:
    """Up, or down where it is negative."""
    speed_m_s = settings.mpc_z_v_auto_up_m_s if climb_m > 0.0 else settings.mpc_z_v_auto_dn_m_s
    return abs(climb_m) / max(speed_m_s, SLOWEST_M_S)


def along_s(settings: Settings, distance_m: float, climb_m: float = 0.0) -> float:
    """Along the ground, and up or down on the way."""
    return max(distance_m / max(settings.mpc_xy_cruise_m_s, SLOWEST_M_S), vertical_s(settings, climb_m))
