"""pymavlink alone uploads a square mission to a vehicle, flies it, and listens until it has landed.

    sitl-emu launch iris                    # in one terminal
    python examples/pymavlink_mission.py    # in another

It listens on the ground station's port; QGroundControl can't run on the same machine meanwhile.
"""

import math
import os
import sys

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mavlink

HEIGHT_M, SIDE_DEG = 10.0, 0.0002
CHUNK = 50  # characters of a STATUSTEXT
READY = 0x10000000  # MAV_SYS_STATUS_PREARM_CHECK


def main(url: str) -> None:
    """Fly."""
    link = mavutil.mavlink_connection(url, source_system=255, dialect="common")
    for _ in range(30):
        link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)  # udpout speaks first
        if link.wait_heartbeat(timeout=1) is not None and link.target_system != 0:  # a camera's may come before
            break
    else:
        sys.exit(f"no vehicle on {url}: is `sitl-emu launch iris` running?")
    me = (link.target_system, 1)
    while not link.recv_match(type="SYS_STATUS", blocking=True).onboard_control_sensors_health & READY:
        pass
    home = link.recv_match(type="GLOBAL_POSITION_INT", blocking=True)

    items = [(mavlink.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0)]
    items += [(mavlink.MAV_CMD_NAV_WAYPOINT, n, e) for n, e in ((1, 0), (1, 1), (0, 1))]
    items += [(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, 0.0, 0.0)]
    link.mav.mission_count_send(*me, len(items), 0)
    while (
        msg := link.recv_match(type=["MISSION_REQUEST_INT", "MISSION_ACK"], blocking=True)
    ).get_type() != "MISSION_ACK":
        command, north, east = items[msg.seq]
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        place = (home.lat + round(north * SIDE_DEG * 1e7), home.lon + round(east * SIDE_DEG * 1e7), HEIGHT_M)
        if command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            frame, place = mavlink.MAV_FRAME_MISSION, (0, 0, 0.0)
        link.mav.mission_item_int_send(*me, msg.seq, frame, command, 0, 1, 0, 0, 0, math.nan, *place, 0)
    if msg.type != mavlink.MAV_MISSION_ACCEPTED:
        sys.exit(f"the mission was refused: {msg.type}")
    print(f"{len(items)} items uploaded")
    while link.recv_match(blocking=False) is not None:
        pass  # what was said of an earlier flight

    custom_mode, mission = 1, (4, 4)  # PX4's AUTO.MISSION
    link.mav.command_long_send(*me, mavlink.MAV_CMD_DO_SET_MODE, 0, custom_mode, *mission, 0, 0, 0, 0)
    link.mav.command_long_send(*me, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
    flying, reached, text = False, -1, ""
    while True:
        link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)
        msg = link.recv_match(type=["MISSION_ITEM_REACHED", "STATUSTEXT", "HEARTBEAT"], blocking=True)
        if msg.get_type() == "MISSION_ITEM_REACHED":
            if msg.seq != reached:  # PX4 says it again for ten seconds
                print(f"item {msg.seq} reached")
            reached = msg.seq
        elif msg.get_type() == "STATUSTEXT":
            text += msg.text
            if msg.id == 0 or len(msg.text) < CHUNK:  # longer ones come in parts, all but the last of them full
                print(text.rstrip("\t"))  # PX4 ends those with a tab that it says as an event, too
                text = ""
        elif msg.get_srcComponent() == 1:
            armed = bool(msg.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
            if flying and not armed:
                break
            flying |= armed
    print("landed")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "udpin:0.0.0.0:14550")
