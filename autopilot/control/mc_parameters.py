"""Speeds of a multicopter that may not exceed others: PX4 lowers the parameter itself and says so.

PX4's mc_pos_control, parameters_update (v1.18). Its limits on tilt and hover thrust are left to the controllers.
"""

from autopilot.constants import Severity
from autopilot.parameters import Parameters
from autopilot.texts import Say

CONSTRAINED = (
    ("MPC_XY_CRUISE", "MPC_XY_VEL_MAX", "Cruise speed", "max speed", "mc_pos_ctrl_cruise_set"),
    ("MPC_VEL_MANUAL", "MPC_XY_VEL_MAX", "Manual speed", "max speed", "mc_pos_ctrl_man_vel_set"),
    ("MPC_VEL_MAN_BACK", "MPC_VEL_MANUAL", "Manual backward speed", "forward speed", "mc_pos_ctrl_man_vel_back_set"),
    ("MPC_VEL_MAN_SIDE", "MPC_VEL_MANUAL", "Manual sideways speed", "forward speed", "mc_pos_ctrl_man_vel_side_set"),
    ("MPC_Z_V_AUTO_UP", "MPC_Z_VEL_MAX_UP", "Ascent speed", "max speed", "mc_pos_ctrl_up_vel_set"),
    ("MPC_Z_V_AUTO_DN", "MPC_Z_VEL_MAX_DN", "Descent speed", "max speed", "mc_pos_ctrl_down_vel_set"),
)
"""Parameter, the one that it may not exceed, what both are called, the event. One may lower the limit of the next."""


def constrain(parameters: Parameters, say: Say) -> None:
    """Lower every speed that exceeds its limit."""
    for name, limit, speed, by, event in CONSTRAINED:
        if parameters[name] > parameters[limit]:
            parameters.set(name, parameters[limit])
            say(Severity.CRITICAL, f"{speed} has been constrained by {by}\t", event, parameters[name])
