"""pymavlink alone uploads a square mission to a vehicle, flies it, and listens until it has landed.

    sitl-emu launch iris                    # in one terminal
    python examples/pymavlink_mission.py    # in another

It listens on the ground station's port; QGroundControl can't run on the same machine meanwhile. Of several vehicles it
flies the one that it hears first: what the others say comes through the same port.
"""

import math
import os
import sys
import time
from typing import Any

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

HEIGHT_M, SIDE_DEG = 10.0, 0.0002
CHUNK = 50  # characters of a STATUSTEXT
READY = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK
AUTOPILOT = 1  # its component; a vehicle's camera and companion say things, too
SILENCE_S = 30.0


class Vehicle:
    """One of the vehicles on a link: its autopilot."""

    def __init__(self, url: str) -> None:
        self.link = mavutil.mavlink_connection(url, source_system=255, dialect="common")
        self.me = (0, AUTOPILOT)  # any system, until one is heard
        self.me = (self.hear("HEARTBEAT").get_srcSystem(), AUTOPILOT)

    def hear(self, *kinds: str) -> Any:
        """The next message of one of these kinds that it sends."""
        end_s = time.monotonic() + SILENCE_S
        while time.monotonic() < end_s:
            self.link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            msg = self.link.recv_match(type=list(kinds), blocking=True, timeout=1)  # udpout has to speak first
            if msg is not None and msg.get_srcComponent() == AUTOPILOT and self.me[0] in (0, msg.get_srcSystem()):
                return msg
        sys.exit(f"no {' or '.join(kinds)} in {SILENCE_S:g} s: is `sitl-emu launch iris` running?")

    def command(self, what: str, number: int, *params: float) -> None:
        """Have it do something, or end."""
        self.link.mav.command_long_send(*self.me, number, 0, *params, *(0.0,) * (7 - len(params)))
        while (ack := self.hear("COMMAND_ACK")).command != number:
            pass
        if ack.result != mavlink.MAV_RESULT_ACCEPTED:
            sys.exit(f"{what} was refused: {mavlink.enums['MAV_RESULT'][ack.result].name}")


def main(url: str) -> None:
    """Fly."""
    vehicle = Vehicle(url)
    link, me = vehicle.link, vehicle.me
    while not vehicle.hear("SYS_STATUS").onboard_control_sensors_health & READY:
        pass
    home = vehicle.hear("GLOBAL_POSITION_INT")

    items = [(mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0)]
    items += [(mavlink.MAV_CMD_NAV_WAYPOINT, n, e) for n, e in ((1, 0), (1, 1), (0, 1))]
    items += [(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 0.0, 0.0)]
    link.mav.mission_count_send(*me, len(items), 0)
    while (msg := vehicle.hear("MISSION_REQUEST_INT", "MISSION_ACK")).get_type() != "MISSION_ACK":
        command, north, east = items[msg.seq]
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        place = (home.lat + round(north * SIDE_DEG * 1e7), home.lon + round(east * SIDE_DEG * 1e7), HEIGHT_M)
        if command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            frame, place = mavlink.MAV_FRAME_MISSION, (0, 0, 0.0)
        link.mav.mission_item_int_send(*me, msg.seq, frame, command, 0, 1, 0, 0, 0, math.nan, *place, 0)
    if msg.type != mavlink.MAV_MISSION_ACCEPTED:
        sys.exit(f"the mission was refused: {mavlink.enums['MAV_MISSION_RESULT'][msg.type].name}")
    print(f"{len(items)} items uploaded")
    while link.recv_match(blocking=False) is not None:
        pass  # what was said of an earlier flight

    custom_mode, mission = 1, (4, 4)  # PX4's AUTO.MISSION
    vehicle.command("mode mission", mavlink.MAV_CMD_DO_SET_MODE, custom_mode, *mission)
    vehicle.command("arming", mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    flying, reached, text = False, -1, ""
    while True:
        msg = vehicle.hear("MISSION_ITEM_REACHED", "STATUSTEXT", "HEARTBEAT")
        if msg.get_type() == "MISSION_ITEM_REACHED":
            if msg.seq != reached:  # PX4 says it again for ten seconds
                print(f"item {msg.seq} reached")
            reached = msg.seq
        elif msg.get_type() == "STATUSTEXT":
            text += msg.text
            if msg.id == 0 or len(msg.text) < CHUNK:  # longer ones come in parts, all but the last of them full
                print(text.rstrip("\t"))  # PX4 ends those with a tab that it says as an event, too
                text = ""
        else:
            armed = bool(msg.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
            if flying and not armed:
                break
            flying |= armed
    print("landed")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "udpin:0.0.0.0:14550")
