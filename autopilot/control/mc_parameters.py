"""Speeds of a multicopter that may not exceed others: PX4 lowers the parameter itself and says so.

PX4's mc_pos_control, parameters_update (v1.18). Its limits on tilt and hover thrust are left to the controllers.
"""

from collections.abc import Callable

from autopilot.constants import Severity
from autopilot.parameters import Parameters

CONSTRAINED = (
    ("MPC_XY_CRUISE", "MPC_XY_VEL_MAX", "Cruise speed has been constrained by max speed"),
    ("MPC_VEL_MANUAL", "MPC_XY_VEL_MAX", "Manual speed has been constrained by max speed"),
    ("MPC_VEL_MAN_BACK", "MPC_VEL_MANUAL", "Manual backward speed has been constrained by forward speed"),
    ("MPC_VEL_MAN_SIDE", "MPC_VEL_MANUAL", "Manual sideways speed has been constrained by forward speed"),
    ("MPC_Z_V_AUTO_UP", "MPC_Z_VEL_MAX_UP", "Ascent speed has been constrained by max speed"),
    ("MPC_Z_V_AUTO_DN", "MPC_Z_VEL_MAX_DN", "Descent speed has been constrained by max speed"),
)
"""Parameter, the one that it may not exceed, and what is said. In this order: one may lower the limit of the next."""


def constrain(parameters: Parameters, say: Callable[[Severity, str], None]) -> None:
    """Lower every speed that exceeds its limit."""
    for name, limit, text in CONSTRAINED:
        if parameters[name] > parameters[limit]:
            parameters.set(name, parameters[limit])
            say(Severity.CRITICAL, text + "\t")
