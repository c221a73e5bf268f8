"""A ground station for the tests: one link, one autopilot, and what most of them ask of it.

Nothing of the product is imported: numbers are PX4's, as literals.
"""

import contextlib
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from pymavlink import mavutil

HEARD_LIMIT_S = 10.0
READY_LIMIT_S = 60.0
OTHERS_S = 1.5
"""In which every autopilot is heard: they have a heartbeat a second (https://mavlink.io/en/services/heartbeat.html)."""
REPLY_LIMIT_S = 10.0
"""For what must come: a busy machine is not a wrong autopilot."""
SETTLE_LIMIT_S = 5.0
DEFAULT_BAUD = 115200
"""pymavlink's; on USB it does not matter."""
STATION_PORT_OFFSET, LAST_PORT = 10_000, 65535
AUTOPILOT = 1
MAVLINK_2, HEADER_BYTES = 0xFD, 10
"""How a frame of MAVLink 2 begins, and how long its header is."""
MEASURED_RELEASE = (1, 18)
"""Of PX4, whose answers are those expected here."""
VERSION_S, VERSION_TRIES = 3.0, 3
PX4 = 12
"""MAV_AUTOPILOT_PX4."""
NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID, of ground stations and companions."""
STANDBY = 3
ARMED = 128
ARM_DISARM, DO_SET_MODE = 400, 176
DENIED = 2
REQUEST_MESSAGE, AUTOPILOT_VERSION = 512, 148
CUSTOM_MODE_ENABLED = 1
HOLD = 4 << 16 | 3 << 24
"""custom_mode: PX4_CUSTOM_MAIN_MODE_AUTO and _SUB_MODE_AUTO_LOITER (commander/px4_custom_mode.h)."""
NO_INDEX = 65535
"""param_index of a parameter that is not in the list."""
MISSION, FENCE, RALLY = 0, 1, 2
LOST = "the autopilot was lost"


class State(NamedTuple):
    """What tests must leave as they found it."""

    base_mode: int
    custom_mode: int
    parameters: dict[str, bytes | None]
    """Values of those that tests have set. Others are PX4's own affair: it keeps what it learns (EKF2_MAG_DECL,
    COM_FLIGHT_UUID), and its list grows when a module starts."""
    items: tuple[int, ...]
    """How many the mission, the fence and the rally points have, those of them that the autopilot knows."""


def _speak_from_the_same_port(url: str, link: Any) -> None:
    """PX4 answers on a link whom it heard there first, until it restarts: a second run must be the same station.

    If the port is taken, this run is another station.
    """
    kind, _, port = url.rpartition(":")
    if kind.startswith("udpout:"):
        with contextlib.suppress(OSError):
            link.port.bind(("", station_port(int(port))))


def station_port(port: int) -> int:
    """Of the station that speaks to an autopilot's port: so far above it, or below where there is no such port."""
    above = port + STATION_PORT_OFFSET
    return above if above <= LAST_PORT else port - STATION_PORT_OFFSET


def _is_of_an_autopilot(heartbeat: Any) -> bool:
    return bool(heartbeat.get_srcComponent() == AUTOPILOT and heartbeat.autopilot != NO_AUTOPILOT)


def _system_of(message: Any) -> int:
    """As the frame says: pymavlink reads no header of messages that it does not know."""
    frame = message.get_msgbuf()
    return int(frame[5] if frame[0] == MAVLINK_2 else frame[3])


def device_and_baud(url: str) -> tuple[str, int]:
    """A serial device and its baud rate, of DEVICE or DEVICE:BAUD; 0 for what is no serial device.

    A device may have colons in its own name (/dev/serial/by-path).
    """
    if not url.startswith("/"):
        return url, 0
    device, _, baud = url.rpartition(":")
    return (url, DEFAULT_BAUD) if Path(url).exists() or not device else (device, int(baud))


class Tcp(mavutil.mavtcp):  # type: ignore[misc]
    """A connection whose end is told: pymavlink would go on reading nothing, as fast as it can."""

    def handle_eof(self) -> None:
        raise ConnectionError("the autopilot has closed the connection")

    handle_disconnect = handle_eof


class Station:
    """A ground station, 255/190, on one link of an autopilot."""

    def __init__(self, url: str) -> None:
        # MAVLink 2 from the first message on: pymavlink would begin with 1, which has no mission types and no events.
        os.environ["MAVLINK20"] = "1"
        device, self.baud = device_and_baud(url)
        mavutil.set_dialect("common")
        us = {"source_system": 255, "source_component": 190}
        self.link: Any = (
            Tcp(device.removeprefix("tcp:"), **us)
            if device.startswith("tcp:")
            else mavutil.mavlink_connection(device, self.baud or DEFAULT_BAUD, **us)
        )
        _speak_from_the_same_port(url, self.link)
        self.mav = self.link.mav
        self.system = 0
        """Of the autopilot, once it is known: then messages of other systems are dropped."""
        self.others: list[int] = []
        """Systems of other autopilots that were heard when this one was."""
        self.vehicle_type = 0
        self.custom_mode: int | None = None
        """That it was found in."""
        self.airframe = 0
        """SYS_AUTOSTART."""
        self.vehicle = ""
        """What it is, in words: version, kind, system id."""
        self.stranger = ""
        """The same if that is not PX4 v1.18 or later: what is denied here, it may do."""
        self.is_lost = False
        self._kinds: tuple[int, ...] | None = None
        """Of plans that the autopilot knows, once it was asked."""
        self.set_first: dict[str, bytes | None] = {}
        """Parameters that tests have set, with the bytes of the values they had."""
        self._heartbeat_s = 0.0

    def wait_until_ready(self, heard_limit_s: float = HEARD_LIMIT_S) -> None:
        """Until the autopilot is in standby; raises TimeoutError if it is not heard, or does not get there.

        Hold is chosen on the way: PX4 is in no standby in a mode that it could not fly, as Position without sticks.
        """
        heard = self._heard(heard_limit_s)
        others = {each.get_srcSystem() for each in self.collect("HEARTBEAT", OTHERS_S) if _is_of_an_autopilot(each)}
        self.others = sorted(others - {heard.get_srcSystem()})
        self.system, self.vehicle_type, self.custom_mode = heard.get_srcSystem(), heard.type, heard.custom_mode
        end_s = time.monotonic() + READY_LIMIT_S
        while (elsewhere := heard.autopilot == PX4 and heard.custom_mode != HOLD) or heard.system_status != STANDBY:
            if time.monotonic() > end_s:
                raise TimeoutError(
                    f"the autopilot is not in standby, in Hold (MAV_STATE {heard.system_status}, custom_mode "
                    f"{heard.custom_mode}) within {READY_LIMIT_S:.0f} s: it must stand disarmed and healthy"
                )
            if elsewhere and not heard.base_mode & ARMED:
                self.mav.command_long_send(
                    self.system, AUTOPILOT, DO_SET_MODE, 0, CUSTOM_MODE_ENABLED, 4, 3, 0, 0, 0, 0
                )
            heard = self.heartbeat() or heard
        self.vehicle = self._introduced(heard)
        self.airframe = int.from_bytes(self.parameter_bytes("SYS_AUTOSTART") or b"", "little")

    def _heard(self, limit_s: float) -> Any:
        """The first heartbeat of an autopilot."""
        end_s = time.monotonic() + limit_s
        while (left_s := end_s - time.monotonic()) > 0.0:
            heartbeat = self.receive("HEARTBEAT", left_s)
            if heartbeat is not None and _is_of_an_autopilot(heartbeat):
                return heartbeat
        rate = f" at {self.baud} baud" if self.baud else ""
        raise TimeoutError(
            f"no autopilot is heard within {limit_s:.0f} s{rate}: is it running, on this port? "
            "(On a link PX4 answers whom it heard there first: if another program spoke there before, restart it)"
        )

    def _introduced(self, heartbeat: Any) -> str:
        kinds = [mavutil.mavlink.enums[enum] for enum in ("MAV_AUTOPILOT", "MAV_TYPE")]
        autopilot, kind = (
            names[number].name if number in names else str(number)
            for names, number in zip(kinds, (heartbeat.autopilot, heartbeat.type), strict=True)
        )
        for _ in range(VERSION_TRIES):
            self.mav.command_long_send(self.system, AUTOPILOT, REQUEST_MESSAGE, 0, AUTOPILOT_VERSION, *(0.0,) * 6)
            version = self.receive("AUTOPILOT_VERSION", VERSION_S)
            if version is not None:
                break
        release = () if version is None else tuple(version.flight_sw_version.to_bytes(4)[:3])
        told = " ".join([autopilot.removeprefix("MAV_AUTOPILOT_"), *([".".join(map(str, release))] if release else [])])
        if heartbeat.autopilot != PX4 or release < MEASURED_RELEASE:
            self.stranger = told if release else f"{told} of a version that it does not tell"
        return f"{told}, {kind}, system {self.system}"

    def parameter_bytes(self, name: str) -> bytes | None:
        """The four bytes of a parameter's value, or None if the autopilot does not tell it."""
        self.mav.param_request_read_send(self.system, AUTOPILOT, name.encode(), -1)
        while (value := self.receive("PARAM_VALUE")) is not None:
            if value.param_id == name:
                return bytes(value.get_msgbuf())[HEADER_BYTES : HEADER_BYTES + 4]
        return None

    def receive(self, name: str | list[str], limit_s: float = REPLY_LIMIT_S) -> Any:
        """The next message of a name from the autopilot's system, or None; heartbeats go out meanwhile."""
        if self.is_lost:
            raise ConnectionError(LOST)
        end_s = time.monotonic() + limit_s
        while (left_s := end_s - time.monotonic()) > 0.0:
            if time.monotonic() - self._heartbeat_s > 1.0:
                self._heartbeat_s = time.monotonic()
                self.mav.heartbeat_send(6, 8, 0, 0, 0)
            message = self.link.recv_match(type=name, blocking=True, timeout=min(left_s, 0.5))
            if message is not None and self.system in (0, _system_of(message)):
                return message
        return None

    def collect(self, name: str | list[str], seconds: float, at_least: int = 0) -> list[Any]:
        """All messages of a name within a time, which goes on for so many: a slow machine is not a wrong autopilot."""
        end_s = time.monotonic() + seconds
        patient_s = end_s + REPLY_LIMIT_S
        found: list[Any] = []
        while (left_s := (patient_s if len(found) < at_least else end_s) - time.monotonic()) > 0.0:
            message = self.receive(name, left_s)
            if message is not None:
                found.append(message)
        return found

    def command(self, number: int, *params: float, limit_s: float = REPLY_LIMIT_S) -> int | None:
        """Send a COMMAND_LONG; the result of its ack, or None."""
        padded = params + (0.0,) * (7 - len(params))
        self.mav.command_long_send(self.system, 1, number, 0, *padded)
        while (ack := self.receive("COMMAND_ACK", limit_s)) is not None:
            if ack.command == number:
                return int(ack.result)
        return None

    def request(self, number: int, *params: float) -> tuple[int | None, Any]:
        """The last ack of REQUEST_MESSAGE, and the last message of that kind which came before it (or None).

        PX4 denies a message of which nothing is new since it was last sent (MavlinkStream::request_message): it is
        asked for again until there is.
        """
        known = mavutil.mavlink.mavlink_map.get(number)
        name = f"UNKNOWN_{number}" if known is None else known.msgname
        end_s = time.monotonic() + REPLY_LIMIT_S
        while True:
            found = None
            self.mav.command_long_send(
                self.system, AUTOPILOT, REQUEST_MESSAGE, 0, number, *params, *(0.0,) * (6 - len(params))
            )
            while (heard := self.receive([name, "COMMAND_ACK"])) is not None:
                if heard.get_type() != "COMMAND_ACK":
                    found = heard
                elif heard.command == REQUEST_MESSAGE:
                    break
            if heard is None or heard.result != DENIED or time.monotonic() > end_s:
                return (None if heard is None else int(heard.result)), found

    def is_listed(self, name: str) -> bool:
        """Whether a parameter gets an index in PX4's list, which it has once a module has looked for it."""
        end_s = time.monotonic() + SETTLE_LIMIT_S
        while time.monotonic() < end_s:
            self.mav.param_request_read_send(self.system, AUTOPILOT, name.encode(), -1)
            value = self.receive("PARAM_VALUE")
            if value is not None and value.param_id == name and value.param_index != NO_INDEX:
                return True
            time.sleep(0.2)
        return False

    def set_parameter(self, name: str, value: float, kind: int) -> None:
        """Send PARAM_SET, `value` being what stands in the float field; the first value is kept, to be left again."""
        if name not in self.set_first:
            self.set_first[name] = self.parameter_bytes(name)
        self.mav.param_set_send(self.system, AUTOPILOT, name.encode(), value, kind)

    def arm_while(self, send: Callable[[], None]) -> int | None:
        """The answer to arming while something is sent 20 times a second; asked again until it is accepted."""
        end_s = time.monotonic() + REPLY_LIMIT_S
        result: int | None = DENIED
        while result != 0 and time.monotonic() < end_s:
            for _ in range(10):
                send()
                time.sleep(0.05)
            result = self.command(ARM_DISARM, 1)
        return result

    def disarm(self) -> None:
        """Disarm, and see it in the heartbeat."""
        end_s = time.monotonic() + SETTLE_LIMIT_S
        while self.heartbeat().base_mode & ARMED:
            assert time.monotonic() < end_s, "still armed"
            self.command(ARM_DISARM, 0)

    def set_mode(self, main: int, sub: int) -> None:
        """Choose a mode, and see it in one of two heartbeats: PX4 answers (Commander::handle_command) before it
        publishes the vehicle_status that HEARTBEAT tells, at the end of its loop."""
        answer = self.command(DO_SET_MODE, CUSTOM_MODE_ENABLED, main, sub)
        assert answer == 0, f"DO_SET_MODE {main}, {sub} is answered {answer}"
        wanted, told = main << 16 | sub << 24, None
        for _ in range(2):
            told = getattr(self.heartbeat(), "custom_mode", None)
            if told == wanted:
                return
        raise AssertionError(
            f"DO_SET_MODE {main}, {sub} is accepted, but custom_mode is told to be {told}, not {wanted}"
        )

    def chooses(self, custom_mode: int) -> bool:
        """Whether it is in a mode, or gets there when that is asked for; one that is armed is not asked."""
        end_s = time.monotonic() + SETTLE_LIMIT_S
        while (heartbeat := self.heartbeat()) is not None and heartbeat.custom_mode != custom_mode:
            if time.monotonic() > end_s or heartbeat.base_mode & ARMED:
                return False
            of_px4 = custom_mode >> 16 & 0xFF, custom_mode >> 24
            self.command(DO_SET_MODE, CUSTOM_MODE_ENABLED, *(of_px4 if heartbeat.autopilot == PX4 else (custom_mode,)))
        return heartbeat is not None

    def heartbeat(self) -> Any:
        """The next heartbeat of the autopilot that was sent after this call; None if there is none in time."""
        while self.link.recv_match(blocking=False) is not None:
            pass
        while (heartbeat := self.receive("HEARTBEAT")) is not None and heartbeat.get_srcComponent() != AUTOPILOT:
            pass
        return heartbeat

    def state(self) -> State:
        """What tests must leave as they found it; raises TimeoutError if the autopilot does not say."""
        heartbeat = self.heartbeat()
        parameters = {name: self.parameter_bytes(name) for name in self.set_first}
        counts = {
            kind: self._announced(kind) for kind in ((MISSION, FENCE, RALLY) if self._kinds is None else self._kinds)
        }
        if self._kinds is None:
            self._kinds = tuple(kind for kind, count in counts.items() if count is not None)
        told = tuple(count for count in counts.values() if count is not None)
        if heartbeat is None or len(told) < len(self._kinds):
            raise TimeoutError("the autopilot does not tell its mode and mission counts")
        return State(heartbeat.base_mode, heartbeat.custom_mode, parameters, told)

    def _announced(self, kind: int) -> int | None:
        """How many items a plan has, or None if the autopilot does not say."""
        self.mav.mission_request_list_send(self.system, AUTOPILOT, kind)
        while (count := self.receive("MISSION_COUNT")) is not None and count.mission_type != kind:
            pass
        # Ends the transfer, which would else be busy for some seconds.
        self.mav.mission_ack_send(self.system, AUTOPILOT, 0, kind)
        return None if count is None else int(count.count)

    def loses(self) -> bool:
        """Whether the autopilot is not heard any more; then nothing is asked of it again."""
        try:
            self.is_lost = self.heartbeat() is None
        except Exception:  # whatever pymavlink's kinds of link raise
            self.is_lost = True
        return self.is_lost
