"""Three quadrotors and two rovers from one launch, each on its own ports, all on a mission at once."""

import contextlib
import math
import time
from typing import Any

from pymavlink import mavutil

from tests.launched import launched

METRES_PER_DEGREE = 111_195.0
FIRST_INSTANCE = 30
LIMIT_S = 150.0
MAV_MODE_FLAG_SAFETY_ARMED = 128
WAYPOINT, TAKEOFF = 16, 22
GLOBAL_RELATIVE_ALT_INT = 6
AUTOPILOT = 1


class Pilot:
    """A ground station on one vehicle's own port."""

    def __init__(self, instance: int, flies: bool) -> None:
        self.system = instance + 1
        self.flies = flies
        self.link: Any = mavutil.mavlink_connection(f"udpout:127.0.0.1:{18570 + instance}", source_system=255)
        self.reached = -1
        self.home: Any = None

    def close(self) -> None:
        """Free the port."""
        self.link.close()

    def receive(self) -> None:
        """Take in what has come: progress, home, and requests for mission items."""
        self.link.mav.heartbeat_send(6, 8, 0, 0, 4)
        while message := self.link.recv_match():
            if (message.get_srcSystem(), message.get_srcComponent()) == (self.system, AUTOPILOT):
                kind = message.get_type()
                if kind == "MISSION_ITEM_REACHED":
                    self.reached = max(self.reached, message.seq)
                elif kind == "HOME_POSITION":
                    self.home = message
                elif kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
                    self.send_item(message.seq)

    def wait(self, kind: str, accept: Any = lambda _message: True) -> Any:
        """The next message of a kind that is accepted."""
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            self.link.mav.heartbeat_send(6, 8, 0, 0, 4)
            message = self.link.recv_match(blocking=True, timeout=0.5)
            if message is None or (message.get_srcSystem(), message.get_srcComponent()) != (self.system, AUTOPILOT):
                continue
            if message.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
                self.send_item(message.seq)
            if message.get_type() == kind and accept(message):
                return message
        raise TimeoutError(f"system {self.system}: no {kind}")

    def items(self) -> list[tuple[int, float, float, float]]:
        """(command, north, east, up): up, out 15 m and 10 m aside; a rover stays down."""
        up = 8.0 if self.flies else 0.0
        route = [(WAYPOINT, 15.0, 0.0, up), (WAYPOINT, 15.0, 10.0, up)]
        return [(TAKEOFF, 0.0, 0.0, up), *route] if self.flies else route

    def send_item(self, seq: int) -> None:
        """Answer a MISSION_REQUEST_INT."""
        command, north, east, up = self.items()[seq]
        lat = self.home.latitude + round(north / METRES_PER_DEGREE * 1e7)
        scale = METRES_PER_DEGREE * math.cos(math.radians(self.home.latitude * 1e-7))
        lon = self.home.longitude + round(east / scale * 1e7)
        frame = GLOBAL_RELATIVE_ALT_INT
        parameters = (0.0, 0.0, 0.0, math.nan)
        self.link.mav.mission_item_int_send(self.system, 1, seq, frame, command, 0, 1, *parameters, lat, lon, up)

    def start(self) -> None:
        """Upload, switch to MISSION and arm."""
        self.home = self.wait("HOME_POSITION")
        self.link.mav.mission_count_send(self.system, 1, len(self.items()))
        assert self.wait("MISSION_ACK").type == 0
        for command, parameters in ((176, (1, 4, 4)), (400, (1, 0, 0))):
            self.link.mav.command_long_send(self.system, 1, command, 0, *parameters, 0, 0, 0, 0)
            assert self.wait("COMMAND_ACK", lambda ack, command=command: ack.command == command).result == 0


def test_three_quadrotors_and_two_rovers_fly_and_drive_at_once() -> None:
    """Every vehicle reaches the last item of its own mission."""
    pilots = [Pilot(FIRST_INSTANCE + place, flies=place < 3) for place in range(5)]
    with contextlib.ExitStack() as stack:
        for pilot in pilots:
            stack.callback(pilot.close)
        stack.enter_context(launched("iris:3", "rover:2", "--instance", str(FIRST_INSTANCE), "--speed", "3"))
        for pilot in pilots:
            pilot.wait("HEARTBEAT", lambda message: message.system_status == 3)
        for pilot in pilots:
            pilot.start()
        end = time.monotonic() + LIMIT_S
        while any(pilot.reached < len(pilot.items()) - 1 for pilot in pilots) and time.monotonic() < end:
            for pilot in pilots:
                pilot.receive()
            time.sleep(0.05)
        assert [pilot.reached for pilot in pilots] == [2, 2, 2, 1, 1]
        for pilot in pilots:
            armed = pilot.wait("HEARTBEAT").base_mode & MAV_MODE_FLAG_SAFETY_ARMED
            assert armed
