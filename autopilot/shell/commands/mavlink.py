"""mavlink: the links and their streams (PX4: modules/mavlink)."""

from collections.abc import Sequence

from sitl_emu.autopilot.mavlink import rates
from sitl_emu.autopilot.mavlink.link import Link
from sitl_emu.autopilot.mavlink.message_statistics import MessageStatistics
from sitl_emu.autopilot.shell.command import FAILURE, SUCCESS, Output, Vehicle, integer, number, usage, warning
from sitl_emu.autopilot.topics import RadioStatus
from sitl_emu.core import dialect as mavlink

MODE_NAMES = {
    "normal": "Normal",
    "onboard": "Onboard",
    "onboard_low_bandwidth": "Onboard",
    "gimbal": "Gimbal",
    "custom": "Custom",
}
UNREACHED_BYTES_PER_S = {"normal": 4e6, "onboard": 4e6, "gimbal": 4e5, "custom": 4e5}
"""Limits of the links that never reach them (px4-rc.mavlink, -r)."""
FRAME_OVERHEAD_BYTES = 12
COMMANDS = (
    ("status", "all links; streams: what each of them sends"),
    ("stream", "-u PORT -s NAME -r HZ: how often a link sends a message (0 off, without: default)"),
    ("boot_complete", ""),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`mavlink COMMAND ...`."""
    command, *words = arguments or [""]
    if command == "status":
        for number_of, link in enumerate(vehicle.mavlink.links):
            yield f"\ninstance #{number_of}:\n"
            yield from _streams(link) if words[:1] == ["streams"] else _status(vehicle, number_of, link)
        return SUCCESS
    if command == "stream":
        return (yield from _stream(vehicle, words))
    if command == "boot_complete":
        return SUCCESS
    yield usage("mavlink", COMMANDS)
    return FAILURE


def _status(vehicle: Vehicle, channel: int, link: Link) -> Output:
    sent, heard = link.bytes_per_s
    if link.statistics is None:
        link.statistics = MessageStatistics()
    # PX4 calls it a percentage, and prints lost messages as a share of those that came
    lost = link.messages_lost / link.messages_received if link.messages_received else 0.0
    limit = {**rates.DATA_RATE_BYTES_PER_S, **UNREACHED_BYTES_PER_S}[link.mode]
    if link.has_gcs(vehicle.now_us):
        yield "\tGCS heartbeat valid\n"
    yield f"\tmavlink chan: #{channel}\n"
    yield "\ttype:\t\tGENERIC LINK OR RADIO\n" if link.radio is None else _radio(link.radio)
    yield "\tflow control: OFF\n"
    yield "\trates:\n"
    yield f"\t  tx: {sent:.1f} B/s\n"
    yield "\t  txerr: 0.0 B/s\n"
    yield f"\t  tx rate mult: {link.rate_multiplier:.3f}\n"
    yield f"\t  tx rate max: {limit:.0f} B/s\n"
    yield f"\t  rx: {heard:.1f} B/s\n"
    yield f"\t  rx loss: {lost:.1f}%\n"
    if link.components:
        yield "\tReceived Messages:\n"
        for sender, of in link.components.items():
            yield f"\t  sysid:{sender[0]:3}, compid:{sender[1]:3}, Total: {of.received} (lost: {of.lost})\n"
            for message_id, rate_hz, ago_s in link.statistics.shown(vehicle.now_us, sender):
                yield f"\t    msgid:{message_id:5}, Rate:{rate_hz:5.1f} Hz, last {ago_s:.2f}s ago\n"
    yield "\tFTP enabled: YES, TX enabled: YES\n"
    yield f"\tmode: {MODE_NAMES[link.mode]}\n"
    yield f"\tForwarding: {'On' if link.forwarding else 'Off'}\n"
    yield "\tMAVLink version: 2\n"
    yield f"\ttransport protocol: UDP ({link.ports.local}, remote port: {link.ports.remote})\n"
    yield "\tBroadcast enabled: NO\n"
    if link.messages_received:
        yield "\tpartner IP: 127.0.0.1\n"
    pings = link.pings
    if pings.answers:
        yield "\tping statistics:\n"
        yield f"\t  last: {pings.last_ms:0.2f} ms\n"
        yield f"\t  mean: {pings.mean_ms:0.2f} ms\n"
        yield f"\t  max: {pings.max_ms:0.2f} ms\n"
        yield f"\t  min: {pings.min_ms:0.2f} ms\n"
        yield f"\t  dropped packets: {pings.dropped}\n"
    return SUCCESS


def _radio(told: RadioStatus) -> str:
    lines = (
        ("rssi:\t\t", told.rssi),
        ("remote rssi:\t", told.remote_rssi),
        ("txbuf:\t", told.txbuf),
        ("noise:\t", told.noise),
        ("remote noise:\t", told.remote_noise),
        ("rx errors:\t", told.rxerrors),
        ("fixed:\t", told.fix),
    )
    return "\ttype:\t\tRADIO Link\n" + "".join(f"\t  {name}{value}\n" for name, value in lines)


def _streams(link: Link) -> Output:
    yield f"\t{'Name':<20}{'Rate Config (current) [Hz]':<16} Message Size (if active) [B]\n"
    for item in link.streams():
        if item.requested_us:
            rate = f"{1e6 / item.requested_us:6.2f} ({1e6 / item.interval_us:.3f})"
        else:
            rate = "unlimited"
        size = item.parts * (item.stream.codec.size + FRAME_OVERHEAD_BYTES)
        yield f"\t{item.stream.name:<30}{rate:<16}" + (f" {size:3}\n" if size else "\n")
    for message_id, interval_us in link.silent_intervals_us.items():
        rate = f"{1e6 / interval_us:6.2f} (0.000)" if interval_us else "unlimited"
        yield f"\t{mavlink.mavlink_map[message_id].msgname:<30}{rate:<16}\n"
    return SUCCESS


def _stream(vehicle: Vehicle, words: list[str]) -> Output:
    options = dict(zip(words[::2], words[1::2], strict=False))
    if "-s" not in options or len(words) % 2 or not options.keys() <= {"-s", "-u", "-r", "-d"}:
        yield usage("mavlink", COMMANDS)
        return FAILURE
    port, name, hz = integer(options.get("-u", "0")), options["-s"], number(options.get("-r", "-1"))
    if "-r" in options and hz < 0.0:
        yield usage("mavlink", COMMANDS)
        return FAILURE
    if "-d" in options:
        device = f"mavlink for device {options['-d']} is not running"
        yield warning("mavlink", "please provide either a device name or a network port" if "-u" in options else device)
        return FAILURE
    link = next((link for link in vehicle.mavlink.links if link.ports.local == port), None)
    if link is None:
        yield warning("mavlink", f"mavlink for network on port {port} is not running")
        return FAILURE
    vehicle.mavlink.configure_stream(vehicle.now_us, link, name, hz)
    return SUCCESS
