"""Everything of a log up to its first data: who wrote it, formats, parameters with their defaults, events' texts,
subscriptions (PX4: Logger::start_log_file).

Of PX4's facts those are left out that would be invented: the compiler (sys_toolchain, sys_toolchain_ver) and the branch
of the source (ver_sw_branch), of which there is none, and the topics that its logger did not find at its start
(excluded_optional_topic_ids, numbers of its build). So is the release of the operating system (sys_os_ver_release): the
same seed gives the same log on every machine.
"""

import hashlib
from collections.abc import Sequence

from sitl_emu.autopilot.logger import packing, ulog
from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.core import c_types

VERSION = "sitl-emu"
SOFTWARE_RELEASE = 17957119
"""ver_sw_release: v1.18.0, release type 255, as AUTOPILOT_VERSION says."""
NO_VENDOR_RELEASE = 255
"""ver_vendor_sw_release: 0.0.0, release type 255."""
DATA_FORMAT = 2
"""ver_data_format: latitudes and longitudes are doubles."""


def messages(
    now_us: int,
    boot_unix_us: int,
    parameters: Parameters,
    subscriptions: Sequence[tuple[int, str, int]],
    events: bytes,
) -> list[bytes]:
    """`boot_unix_us`: the date of time 0; `subscriptions`: number, topic, instance; `events`: their packed metadata."""
    offset_min = int(parameters["SDLOG_UTC_OFFSET"])
    found = [
        ulog.file_header(now_us),
        ulog.FLAG_BITS,
        ulog.information("ver_sw", VERSION),
        ulog.information("ver_sw_release", SOFTWARE_RELEASE, "uint32_t"),
        ulog.information("ver_vendor_sw_release", NO_VENDOR_RELEASE, "uint32_t"),
        ulog.information("ver_hw", "PX4_SITL"),
        ulog.information("sys_name", "PX4"),
        ulog.information("sys_os_name", "Linux"),
        ulog.information("ver_data_format", DATA_FORMAT, "uint32_t"),
        ulog.information("time_ref_utc", offset_min * 60),
        ulog.information("boot_time_utc_us", boot_unix_us + offset_min * 60_000_000, "uint64_t"),
        ulog.information_multiple("boot_console_output", f"{VERSION} stands for PX4 v1.18.0\n"),
    ]
    found += packing.definitions([name for _, name, _ in subscriptions])
    for name in parameters:
        found.append(ulog.parameter(name, parameters[name], parameters.is_float(name)))
    for name in parameters:
        found += _defaults_of(parameters, name)
    if events:
        found.append(ulog.information_multiple("metadata_events", events))
        found.append(ulog.information("metadata_events_sha256", hashlib.sha256(events).hexdigest()))
    return found + [ulog.subscription(*each) for each in subscriptions]


def _defaults_of(parameters: Parameters, name: str) -> list[bytes]:
    """Those defaults that differ from the value, as its type holds them; of what PX4 calls volatile none."""
    row, is_float = parameters.row(name), parameters.is_float(name)
    if row.get("volatile"):
        return []

    def held(value: float) -> float:
        return c_types.float32(value) if is_float else value

    value, of_setup, of_system = (held(each) for each in (parameters[name], parameters.default(name), row["default"]))
    if of_setup == of_system:
        both = ulog.DEFAULT_OF_SETUP | ulog.DEFAULT_OF_SYSTEM
        return [] if value == of_setup else [ulog.parameter_default(name, of_setup, is_float, both)]
    found = []
    if value != of_setup:
        found.append(ulog.parameter_default(name, of_setup, is_float, ulog.DEFAULT_OF_SETUP))
    if value != of_system:
        found.append(ulog.parameter_default(name, of_system, is_float, ulog.DEFAULT_OF_SYSTEM))
    return found
