"""Any autopilot in a run, a real PX4 for one: what its command and its environment are told.

It connects to TCP 4560+i as PX4 does. What the airframe is, actuators' order and limits among it, goes to it by PX4's
own way of setting parameters from outside, `PX4_PARAM_NAME` in the environment (ROMFS/px4fmu_common/init.d-posix/rcS);
who is no PX4 does without.
"""

from collections.abc import Mapping

from sitl_emu.vehicles import Vehicle

OWN_AFFAIRS = ("CAL_", "COM_CPU_", "COM_RAM_", "SDLOG_", "SENS_", "SIM_", "SYS_", "TRIG_")
"""Parameters of our airframe files that are about the board an autopilot runs on, its sensors and its logs, and not
about the airframe. PX4's own start-up sets them as its simulation needs them."""


def filled(text: str, words: Mapping[str, str]) -> str:
    """A text with its words in braces filled in."""
    for name, value in words.items():
        text = text.replace("{" + name + "}", value)
    return text


def environment(vehicle: Vehicle, given: Mapping[str, str], words: Mapping[str, str]) -> dict[str, str]:
    """What is added to the environment of an outside autopilot: its airframe, and what the scenario gives."""
    airframe = {
        f"PX4_PARAM_{name}": repr(value) for name, value in vehicle.airframe.items() if not name.startswith(OWN_AFFAIRS)
    }
    return airframe | {name: filled(value, words) for name, value in given.items()}
