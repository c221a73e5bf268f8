"""How long parts of a return take at the vehicle's own speeds. PX4's RtlTimeEstimator (src/lib/rtl, v1.18).

What does not fly drives at RO_SPEED_LIM, and up and down at once; without a limit its way takes no time either.
"""

from sitl_emu.autopilot.navigator.state import NavigatorState
from sitl_emu.core.c_types import quotient

SLOWEST_M_S = 0.1
"""Below this a speed is none, and would make a return endless; ours."""


def vertical_s(state: NavigatorState, climb_m: float) -> float:
    """Up, or down where it is negative."""
    if not state.traits.flies:
        return 0.0
    settings = state.settings
    speed_m_s = settings.mpc_z_v_auto_up_m_s if climb_m > 0.0 else settings.mpc_z_v_auto_dn_m_s
    return abs(climb_m) / max(speed_m_s, SLOWEST_M_S)


def along_s(state: NavigatorState, distance_m: float, climb_m: float = 0.0) -> float:
    """Along the ground, and up or down on the way."""
    settings = state.settings
    if not state.traits.flies:
        return max(quotient(distance_m, settings.ro_speed_lim_m_s), 0.0) if distance_m > 0.0 else 0.0
    return max(distance_m / max(settings.mpc_xy_cruise_m_s, SLOWEST_M_S), vertical_s(state, climb_m))
