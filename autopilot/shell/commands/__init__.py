"""The shell's commands, one file each, named as PX4's module or system command."""

from autopilot.shell.command import Command
from autopilot.shell.commands import commander, listener, mavlink, param, sleep, uorb, ver

COMMANDS: dict[str, Command] = {
    "commander": commander.main,
    "listener": listener.main,
    "mavlink": mavlink.main,
    "param": param.main,
    "sleep": sleep.main,
    "uorb": uorb.main,
    "ver": ver.main,
}
