"""A companion of one's own: a mission in twenty lines, on simulated or real hardware.

    sitl-emu launch iris                # in one terminal
    python examples/own_companion.py    # in another

It takes off, waits ten seconds and lands; a pilot who chooses another mode takes over at any time. The mission is a
script on a clock that it is handed: `Onboard` brings telemetry, services, heartbeats and yielding, `steps` what many
missions do, and `Scripted` makes a companion of it. Whatever runs it gives it sockets and a clock; here that is `fly`.
"""

import sys

from sitl_emu.companion import LinkError, Onboard, Script, Scripted, fly, set_mode, steps


def up_and_down(onboard: Onboard) -> Script:
    """What happens, in order."""
    yield from steps.heard(onboard)
    yield from steps.ready(onboard, timeout_s=120.0)
    yield from steps.command(onboard, set_mode(onboard.system_id, "takeoff"), "mode takeoff")
    yield from steps.arm(onboard)
    onboard.yielding.expect({"takeoff", "hold"})
    onboard.enter("climbing", "to the take-off altitude")
    while onboard.telemetry.mode != "hold":
        yield
    onboard.enter("waiting", "10 s")
    yield from steps.pause(onboard, 10.0)
    onboard.enter("landing", "where it stands")
    yield from steps.command(onboard, set_mode(onboard.system_id, "land"), "mode land")
    onboard.yielding.expect({"land", "hold"})
    yield from steps.until_landed(onboard)


if __name__ == "__main__":
    try:
        status = fly(Scripted(up_and_down), sys.argv[1] if len(sys.argv) > 1 else "udpin:0.0.0.0:14540")
    except LinkError as error:
        sys.exit(str(error))
    if status.outcome != "success":
        sys.exit(status.outcome)
    print("landed")
