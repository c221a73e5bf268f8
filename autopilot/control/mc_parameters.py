"""Parameters of a multicopter that the position controller changes itself, and says so.

PX4's MulticopterPositionControl::parameters_update (src/modules/mc_pos_control, v1.18): three parameters set many
others at once, where they are not negative; then every value that exceeds its limit is brought back to it.
"""

from typing import Final

from sitl_emu.autopilot.constants import Severity
from sitl_emu.autopilot.events.texts import Say
from sitl_emu.autopilot.parameters import Parameters

MAX_SAFE_TILT_DEG: Final = 89.0
"""MulticopterPositionControl::MAX_SAFE_TILT_DEG."""
CONSTRAINED = (
    ("MPC_TILTMAX_LND", "MPC_TILTMAX_AIR", "Land tilt", "max tilt", "mc_pos_ctrl_land_tilt_set"),
    ("MPC_XY_CRUISE", "MPC_XY_VEL_MAX", "Cruise speed", "max speed", "mc_pos_ctrl_cruise_set"),
    ("MPC_VEL_MANUAL", "MPC_XY_VEL_MAX", "Manual speed", "max speed", "mc_pos_ctrl_man_vel_set"),
    ("MPC_VEL_MAN_BACK", "MPC_VEL_MANUAL", "Manual backward speed", "forward speed", "mc_pos_ctrl_man_vel_back_set"),
    ("MPC_VEL_MAN_SIDE", "MPC_VEL_MANUAL", "Manual sideways speed", "forward speed", "mc_pos_ctrl_man_vel_side_set"),
    ("MPC_Z_V_AUTO_UP", "MPC_Z_VEL_MAX_UP", "Ascent speed", "max speed", "mc_pos_ctrl_up_vel_set"),
    ("MPC_Z_V_AUTO_DN", "MPC_Z_VEL_MAX_DN", "Descent speed", "max speed", "mc_pos_ctrl_down_vel_set"),
)
"""Parameter, the one that it may not exceed, what both are called, the event. One may lower the limit of the next."""


def constrain(parameters: Parameters, say: Say) -> None:
    """Set what the common parameters ask for, then bring every value that exceeds its limit back to it."""
    _set_common(parameters)
    if parameters["MPC_TILTMAX_AIR"] > MAX_SAFE_TILT_DEG:
        parameters.set("MPC_TILTMAX_AIR", MAX_SAFE_TILT_DEG)
        say(Severity.CRITICAL, "Tilt constrained to safe value\t", "mc_pos_ctrl_tilt_set", MAX_SAFE_TILT_DEG)
    for name, limit, value, by, event in CONSTRAINED:
        if parameters[name] > parameters[limit]:
            parameters.set(name, parameters[limit])
            say(Severity.CRITICAL, f"{value} has been constrained by {by}\t", event, parameters[name])
    hover, least, most = (float(parameters[f"MPC_THR_{which}"]) for which in ("HOVER", "MIN", "MAX"))
    if hover > most or hover < least:
        parameters.set("MPC_THR_HOVER", max(least, min(most, hover)))
        text = "Hover thrust has been constrained by min/max\t"
        say(Severity.CRITICAL, text, "mc_pos_ctrl_hover_thrust_set", parameters["MPC_THR_HOVER"])


def _set_common(parameters: Parameters) -> None:
    wanted: dict[str, float] = {}
    response = float(parameters["SYS_VEHICLE_RESP"])
    if response >= 0.0:
        wanted |= of_responsiveness(response)
    speed_xy, speed_z = float(parameters["MPC_XY_VEL_ALL"]), float(parameters["MPC_Z_VEL_ALL"])
    if speed_xy >= 0.0:
        wanted |= dict.fromkeys(("MPC_VEL_MANUAL", "MPC_XY_CRUISE", "MPC_XY_VEL_MAX"), speed_xy)
        wanted |= dict.fromkeys(("MPC_VEL_MAN_BACK", "MPC_VEL_MAN_SIDE"), -1.0)
    if speed_z >= 0.0:
        wanted |= dict.fromkeys(("MPC_Z_V_AUTO_UP", "MPC_Z_VEL_MAX_UP"), speed_z)
        wanted |= dict.fromkeys(("MPC_Z_V_AUTO_DN", "MPC_Z_VEL_MAX_DN"), 0.75 * speed_z)
        wanted |= {"MPC_TKO_SPEED": 0.6 * speed_z, "MPC_LAND_SPEED": 0.5 * speed_z}
    parameters.set_quietly(wanted)


def of_responsiveness(response: float) -> dict[str, float]:
    """What SYS_VEHICLE_RESP (0: gentle, 1: as quick as can be) asks of accelerations, jerks, tilt and yaw."""
    quick = response * response

    def between(gentle: float, quickest: float, share: float = quick) -> float:
        return gentle + (quickest - gentle) * share

    return {
        "MPC_ACC_HOR": between(1.0, 15.0),
        "MPC_ACC_HOR_MAX": between(2.0, 15.0),
        "MPC_MAN_Y_MAX": between(80.0, 450.0),
        "MPC_MAN_Y_TAU": 0.0 if quick > 0.6 else between(0.5, 0.0, quick / 0.6),
        "MPC_TILTMAX_AIR": 45.0 if quick < 0.5 else min(MAX_SAFE_TILT_DEG, between(45.0, 70.0, (quick - 0.5) * 2.0)),
        "MPC_ACC_DOWN_MAX": between(0.8, 15.0),
        "MPC_ACC_UP_MAX": between(1.0, 15.0),
        "MPC_JERK_MAX": between(2.0, 50.0),
        "MPC_JERK_AUTO": between(1.0, 25.0),
    }
