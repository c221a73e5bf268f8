"""ver: versions, as the emulated build has them (PX4: systemcmds/ver)."""

import platform
from collections.abc import Sequence

from sitl_emu.autopilot.mavlink.streams import autopilot_version
from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, error, usage

BOARD = "PX4_SITL"
EXAMPLES = {"hwcmp": "PX4_FMU_V2", "hwtypecmp": "{V2|V2M|V30|V31}"}
RELEASE = 255
"""FIRMWARE_VERSION_TYPE_OFFICIAL, the last byte of a released version's number."""
GUID_DIGITS = 36
COMMANDS = (
    ("hw", "board"),
    ("mcu", "processor"),
    ("git", "versions and git hashes"),
    ("bdate", "date of the build"),
    ("gcc", "compiler"),
    ("px4guid", "the vehicle's identifier"),
    ("uri", "where the build comes from"),
    ("all", "all of these"),
    ("hwcmp", "succeed if the board is one of those named"),
    ("hwtypecmp", "succeed if the board's type is one of those named"),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`ver WHAT`; what names a compiler or a date on PX4 names the emulator here."""
    if not arguments:
        yield usage("ver", COMMANDS)
        return FAILURE
    what = arguments[0]
    if what in ("hwcmp", "hwtypecmp"):
        if len(arguments) < 2:
            yield error("ver", f"Not enough arguments, try 'ver {what} {EXAMPLES[what]}'")
            return FAILURE
        return SUCCESS if what == "hwcmp" and BOARD in arguments[1:] else FAILURE
    sections = {
        "hw": f"HW arch: {BOARD}\n",
        "git": _git(),
        "bdate": "Build datetime: none, this is sitl-emu\n",
        "uri": "Build uri: sitl-emu\n",
        "variant": "Build variant: sih\n",
        "gcc": f"Toolchain: {platform.python_implementation()}, {platform.python_version()}\n",
        "px4guid": f"PX4GUID: {_guid(vehicle)}\n",
        "mcu": "UNKNOWN MCU\n",
    }
    if what == "all":
        yield from sections.values()
    elif what in sections and what != "variant":
        yield sections[what]
    else:
        yield error("ver", "unknown command")
        return FAILURE
    return SUCCESS


def _git() -> str:
    number = autopilot_version.FLIGHT_SW_VERSION
    major, minor, patch, kind = number.to_bytes(4, "big")
    version = f"{major}.{minor}.{patch}"
    version = f"Release {version} ({number})" if kind == RELEASE else f"{version} {kind:x} ({number})"
    git_hash = autopilot_version.CUSTOM_VERSION[3:].hex()
    return (
        f"PX4 git-hash: {git_hash}\nPX4 version: {version}\n"
        f"OS: {platform.system()}\nOS version: Release {platform.release().split('-')[0]}\n"
    )


def _guid(vehicle: Vehicle) -> str:
    uid = autopilot_version.UID + int(vehicle.parameters["MAV_SYS_ID"])
    return f"{uid:0{GUID_DIGITS}x}"
