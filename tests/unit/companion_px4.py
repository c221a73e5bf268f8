"""A stand-in for a PX4, for tests of the ground side and the companions: a few rules, written down as literals.

It serves the mission protocol, a handful of commands and telemetry at 20 Hz, and moves on rails: straight to the next
waypoint at constant speed. No physics, no estimator, no refusals but those a test asks for.
"""

import math
import struct
from collections.abc import Callable
from typing import Any

from sitl_emu.core import dialect as mavlink

HOLD, MISSION, RETURN, POSITION = (4, 3), (4, 4), (4, 5), (3, 0)
METRES_PER_DEG = math.radians(1.0) * 6371000.0
STEP_US = 20_000
RETRY_US, GIVE_UP_US = 267_000, 5_000_000


def on_the_wire(msg: Any, system: int, component: int) -> Any:
    """The message as its receiver sees it, packed and parsed again, with its sender in the header."""
    mav = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    return mav.decode(bytearray(msg.pack(mav)))


class MissionServer:
    """PX4's half of the mission protocol: leads an upload, repeats requests after 0.267 s, gives up after 5 s."""

    def __init__(self) -> None:
        self.items: dict[int, list[Any]] = {0: [], 1: [], 2: []}
        self.accepted = 0
        self.refuse: int | None = None
        self._upload: dict[str, Any] | None = None
        self._finished: tuple[int, int, int, int] | None = None

    def on_message(self, now_us: int, msg: Any) -> list[Any]:
        kind, sender = msg.get_type(), (msg.get_srcSystem(), msg.get_srcComponent())
        if kind == "MISSION_COUNT":
            up = self._upload
            if up and up["sender"] == sender:
                if up["items"]:
                    return [mavlink.MAVLink_mission_ack_message(*sender, 1, msg.mission_type)]
                return [self._request(now_us)]
            if msg.count == 0:
                self.items[msg.mission_type] = []
                return [mavlink.MAVLink_mission_ack_message(*sender, 0, msg.mission_type)]
            self._upload = {
                "sender": sender,
                "type": msg.mission_type,
                "count": msg.count,
                "items": [],
                "heard_us": now_us,
            }
            return [self._request(now_us)]
        if kind == "MISSION_ITEM_INT":
            up = self._upload
            if up is None:
                if self._finished == (*sender, msg.mission_type, msg.seq):
                    return [mavlink.MAVLink_mission_ack_message(*sender, 0, msg.mission_type)]
                return [mavlink.MAVLink_mission_ack_message(*sender, 1, msg.mission_type)]
            up["heard_us"] = now_us
            if msg.seq != len(up["items"]):
                return [self._request(now_us)]
            if self.refuse is not None:
                self._upload = None
                return [mavlink.MAVLink_mission_ack_message(*sender, self.refuse, msg.mission_type)]
            up["items"].append(msg)
            if len(up["items"]) < up["count"]:
                return [self._request(now_us)]
            self.items[up["type"]] = up["items"]
            self.accepted += up["type"] == 0
            self._finished, self._upload = (*sender, up["type"], msg.seq), None
            return [mavlink.MAVLink_mission_ack_message(*sender, 0, msg.mission_type)]
        if kind == "MISSION_REQUEST_LIST":
            count = len(self.items[msg.mission_type])
            return [mavlink.MAVLink_mission_count_message(*sender, count, msg.mission_type)]
        if kind == "MISSION_REQUEST_INT" and msg.seq < len(self.items[msg.mission_type]):
            item = self.items[msg.mission_type][msg.seq]
            fields = {name: getattr(item, name) for name in item.get_fieldnames()}
            fields["target_system"], fields["target_component"] = sender
            return [mavlink.MAVLink_mission_item_int_message(**fields)]
        if kind == "MISSION_CLEAR_ALL":
            for mission_type in (0, 1, 2) if msg.mission_type == 255 else (msg.mission_type,):
                self.items[mission_type] = []
            return [mavlink.MAVLink_mission_ack_message(*sender, 0, msg.mission_type)]
        return []

    def on_time(self, now_us: int) -> list[Any]:
        up = self._upload
        if up is None:
            return []
        if now_us - up["heard_us"] > GIVE_UP_US:
            self._upload = None
            return []
        return [self._request(now_us)] if now_us - up["asked_us"] >= RETRY_US else []

    def _request(self, now_us: int) -> Any:
        assert self._upload is not None
        self._upload["asked_us"] = now_us
        fields: list[Any] = [*self._upload["sender"], len(self._upload["items"]), self._upload["type"]]
        return mavlink.MAVLink_mission_request_int_message(*fields)


class FakePx4:
    """An autopilot with a vehicle on rails."""

    def __init__(self, system: int, mav_type: int, north_m: float, east_m: float, speed_m_s: float) -> None:
        self.system, self.mav_type, self.speed_m_s = system, mav_type, speed_m_s
        self.home = (40.47, -86.99, 215.0)
        self.north_m, self.east_m, self.up_m = north_m, east_m, 0.0
        self.start = (north_m, east_m)
        self.velocity = (0.0, 0.0, 0.0)
        self.yaw = self.pitch = 0.0
        self.mode, self.armed, self.ready_us = HOLD, False, 2_000_000
        self.missions = MissionServer()
        self.seq = 0
        self.goal: tuple[float, float] | None = None
        self.heard: list[Any] = []
        self.commands: list[tuple[int, float]] = []
        self.parameters: dict[str, float] = {}
        self.kept = set[str]()
        """Parameters whose values it does not change."""
        self.ack: Callable[[int], int] = lambda command: 0
        self._sent_us: dict[str, int] = {}
        self._loaded = 0
        self._state = mavlink.MAV_STATE_ACTIVE
        self._told: list[Any] = []

    def enter_failsafe(self, now_us: int, mode: tuple[int, int], cause: int) -> None:
        """As PX4 does it: the event commander_failsafe_enter says why, the mode changes, the heartbeat is CRITICAL."""
        arguments = struct.pack("<IBB", self.mode[0] << 16 | self.mode[1] << 24, 6, cause).ljust(40, b"\0")
        self._told.append(mavlink.MAVLink_event_message(26528394, now_us // 1000, 1, 0, 0, 0x21, list(arguments)))
        self.mode, self.goal, self._state = mode, None, mavlink.MAV_STATE_CRITICAL

    def terminate(self, now_us: int) -> None:
        """A failsafe ends the flight, as PX4 does it: the event tells, and the mode that is shown stays what it was."""
        arguments = struct.pack("<IB", self.mode[0] << 16 | self.mode[1] << 24, 10).ljust(40, b"\0")
        self._told.append(mavlink.MAVLink_event_message(31382480, now_us // 1000, 1, 0, 0, 0x21, list(arguments)))
        self.speed_m_s, self._state = 0.0, mavlink.MAV_STATE_FLIGHT_TERMINATION

    def choose(self, mode: tuple[int, int]) -> None:
        """A pilot's change of mode, which ends a failsafe."""
        self.mode, self.goal, self._state = mode, None, mavlink.MAV_STATE_ACTIVE

    def on_message(self, now_us: int, msg: Any) -> list[Any]:
        """What reaches it from its companion's link; returns its answers, packed and parsed."""
        self.heard.append(msg)
        kind = msg.get_type()
        answers: list[Any] = []
        if getattr(msg, "target_system", 0) not in (0, self.system) or getattr(msg, "target_component", 1) not in (
            0,
            1,
        ):
            return []
        if kind == "MISSION_SET_CURRENT":
            self.seq = msg.seq
        elif kind.startswith("MISSION_"):
            answers = self.missions.on_message(now_us, msg)
        elif kind in ("COMMAND_LONG", "COMMAND_INT"):
            result = self.ack(msg.command)
            self.commands.append((msg.command, msg.param1))
            if result == 0:
                self._obey(msg)
            sender = (msg.get_srcSystem(), msg.get_srcComponent())
            answers = [mavlink.MAVLink_command_ack_message(msg.command, result, 255, 0, *sender)]
        elif kind == "PARAM_SET":
            if msg.param_id not in self.kept:
                self.parameters[msg.param_id] = msg.param_value
            value = self.parameters.get(msg.param_id, 0.0)
            answers = [mavlink.MAVLink_param_value_message(msg.param_id.encode(), value, msg.param_type, 900, 65535)]
        return [on_the_wire(answer, self.system, 1) for answer in answers]

    def on_time(self, now_us: int) -> list[Any]:
        """Moves on by `STEP_US`; returns telemetry."""
        if self.missions.accepted != self._loaded:
            self._loaded, self.seq = self.missions.accepted, 0
        out = self._told + self.missions.on_time(now_us)
        self._told = []
        if self.armed:
            out += self._move()
        else:
            self.velocity = (0.0, 0.0, 0.0)
        ms = now_us // 1000
        lat = self.home[0] + self.north_m / METRES_PER_DEG
        lon = self.home[1] + self.east_m / METRES_PER_DEG / math.cos(math.radians(self.home[0]))
        v_n, v_e, v_d = (round(v * 100) for v in self.velocity)
        if self._due(now_us, "position", 50_000):
            yaw, pitch = self.yaw / 2.0, self.pitch / 2.0
            q = (
                math.cos(yaw) * math.cos(pitch), -math.sin(yaw) * math.sin(pitch),
                math.cos(yaw) * math.sin(pitch), math.sin(yaw) * math.cos(pitch),
            )  # fmt: skip
            out += [
                mavlink.MAVLink_global_position_int_message(
                    ms,
                    round(lat * 1e7),
                    round(lon * 1e7),
                    round((self.home[2] + self.up_m) * 1e3),
                    round(self.up_m * 1e3),
                    v_n,
                    v_e,
                    v_d,
                    0,
                ),
                mavlink.MAVLink_attitude_quaternion_message(ms, *q, 0, 0, 0),
            ]
        if self._due(now_us, "slow", 500_000):
            health = 0x10000000 if now_us >= self.ready_us else 0
            home = (round(self.home[0] * 1e7), round(self.home[1] * 1e7), round(self.home[2] * 1e3))
            landed = 1 if self.up_m < 0.05 and self.mav_type != 10 else 2
            custom = self.mode[0] << 16 | self.mode[1] << 24
            out += [
                mavlink.MAVLink_heartbeat_message(self.mav_type, 12, 29 | self.armed << 7, custom, self._state, 3),
                mavlink.MAVLink_sys_status_message(0, 0, health, 0, 0, 0, 90, 0, 0, 0, 0, 0, 0),
                mavlink.MAVLink_home_position_message(*home, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0),
                mavlink.MAVLink_extended_sys_state_message(0, landed),
                mavlink.MAVLink_mission_current_message(self.seq),
            ]
        return [on_the_wire(msg, self.system, 1) for msg in out]

    def _due(self, now_us: int, name: str, period_us: int) -> bool:
        if now_us - self._sent_us.get(name, -period_us) < period_us:
            return False
        self._sent_us[name] = now_us
        return True

    def _obey(self, msg: Any) -> None:
        if msg.command == 176:
            self.mode, self.goal = (int(msg.param2), int(msg.param3)), None
        elif msg.command == 400:
            self.armed = msg.param1 == 1
        elif msg.command == 192:
            self.mode = HOLD
            self.goal = self._metres(msg.x, msg.y)

    def _metres(self, x: int, y: int) -> tuple[float, float]:
        north = (x * 1e-7 - self.home[0]) * METRES_PER_DEG
        return north, (y * 1e-7 - self.home[1]) * METRES_PER_DEG * math.cos(math.radians(self.home[0]))

    def _move(self) -> list[Any]:
        flies, dt, out = self.mav_type != 10, STEP_US * 1e-6, list[Any]()
        goal, climb = self.goal if self.mode == HOLD else None, 0.0
        if self.mode == MISSION and self.seq < len(self.missions.items[0]):
            item = self.missions.items[0][self.seq]
            if item.command == 22:
                climb = 3.0
                if self.up_m >= item.z:
                    out += self._reached()
            elif item.command == 16:
                goal = self._metres(item.x, item.y)
                if math.dist(goal, (self.north_m, self.east_m)) < self.speed_m_s * dt + 0.02:
                    out += self._reached()
            elif item.command == 20:
                self.mode = RETURN
            else:
                self.seq += 1
        elif self.mode == RETURN:
            goal = self.start
            if math.dist(goal, (self.north_m, self.east_m)) < 0.5:
                climb = -3.0
                if self.up_m <= 0.0 or not flies:
                    self.armed, self.mode = False, HOLD
        north, east = 0.0, 0.0
        if goal is not None:
            away = math.dist(goal, (self.north_m, self.east_m))
            if away > 0.01:
                speed = min(self.speed_m_s, away / dt)
                north = (goal[0] - self.north_m) / away * speed
                east = (goal[1] - self.east_m) / away * speed
                self.yaw = math.atan2(east, north)
        self.north_m, self.east_m = self.north_m + north * dt, self.east_m + east * dt
        self.up_m = max(0.0, self.up_m + climb * dt) if flies else 0.0
        self.velocity = (north, east, -climb)
        return out

    def _reached(self) -> list[Any]:
        reached, self.seq = self.seq, self.seq + 1
        if self.seq == len(self.missions.items[0]):
            self.mode, self.goal = HOLD, None
        return [mavlink.MAVLink_mission_item_reached_message(reached)]
