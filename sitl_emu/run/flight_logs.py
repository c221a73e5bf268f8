"""The flight logs of a run, found in its folder: `VEHICLE.ulg` and, for later ones, `VEHICLE-2.ulg` and so on."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from sitl_emu.autopilot.storage.storage import LOG
from sitl_emu.run.configs import ROOTFS


def show(folder: Path, vehicles: Sequence[str]) -> None:
    """Link the logs that autopilots, ours and others, left in their file systems. Raises OSError."""
    for name in vehicles:
        logs = sorted((folder / ROOTFS / name / LOG).rglob("*.ulg"))
        for number, log in enumerate(logs, 1):
            link = folder / (f"{name}.ulg" if number == 1 else f"{name}-{number}.ulg")
            try:
                link.symlink_to(log.relative_to(folder))
            except OSError:  # the file system has no links, such as a USB stick's
                shutil.copyfile(log, link)
