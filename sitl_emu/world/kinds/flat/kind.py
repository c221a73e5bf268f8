"""A level plain without end at PX4's default home, for flying without a mission."""

from collections.abc import Mapping
from typing import Any

from sitl_emu.world.description import Origin, WorldDescription, WorldError
from sitl_emu.world.kinds import Generated


def generate(seed: int, options: Mapping[str, Any]) -> Generated:
    """See kinds; there are no options. The origin is PX4's default home, near Zürich (SIH_LOC_LAT0, _LON0, _H0)."""
    if options:
        raise WorldError(f"world flat has no option {next(iter(options))!r}: only things, which any world has")
    return Generated(WorldDescription(name="flat", kind="flat", seed=seed, origin=Origin()))
