"""RC channels to sticks and switches, by the calibration and the mapping. PX4's rc_update (v1.18).

Channels come as RC_CHANNELS_OVERRIDE (topics.input_rc). A channel is held within RCn_MIN and RCn_MAX, is 0 at RCn_TRIM
(v1.18 has no dead zone) and is turned by RCn_REV; RC_MAP_* say which one is which stick or switch. Without a calibrated
receiver (RC_CHAN_CNT) there are no sticks. Fewer than four channels, fewer than three messages a second, or the
failsafe channel beyond RC_FAILS_THR are no signal.

Three channels may turn parameters: RC_MAP_PARAMn says which channel, PARAM_MAP_RC which parameter (once a second, when
the channel has moved).

Left out: receivers other than MAVLink.
"""

import struct
from typing import NamedTuple

from sitl_emu.autopilot.parameters import Parameters
from sitl_emu.autopilot.topics import SOURCE_RC, InputRc, ManualControlInput, ManualControlSwitches, Topics
from sitl_emu.core.c_types import float32, product

CHANNELS = 18
FEWEST_CHANNELS = 4
LONGEST_GAP_US = 333_333
"""Messages that come less often are no signal."""
REGAINED_US = 100_000
"""So long a signal is there before it counts: some receivers begin with nonsense (_rc_signal_lost_hysteresis)."""
UNCHANGED_EVERY_US = 300_000
"""Sticks whose channels have not moved are told no more often than so."""
MODE_SLOTS = 6
BUTTON_PRESSED = 0.5
BUTTON_HELD_US = 50_000
"""Of a button for a mode (RC_MAP_FLTM_BTN): how far its channel is, and for how long (_button_pressed_hysteresis)."""
SLOT_MARGIN = 0.05
OFF, ON = 3, 1
"""manual_control_switches SWITCH_POS; 0 is a switch that is not mapped."""
NOT_MAPPED = 0
TERMINATION_THRESHOLD = 0.75
"""The one that no parameter gives."""
SWITCHES_EVERY_US = 1_000_000
PARAMETERS_EVERY_US = 1_000_000
SMALLEST_MOVE = 2.0**-23


class Channel(NamedTuple):
    """Calibration of one channel, in µs of pulse."""

    minimum: float
    trim: float
    maximum: float
    reverse: bool

    def scaled(self, value: float) -> float:
        """-1..1; where the trim lies at an end, that is the end of the stick all the same (math::interpolateNXY).

        A switch in the middle is on or off by a float32's last bit, where its threshold is 0.5.
        """
        low, high, base = (self.trim, self.maximum, 0.0) if value > self.trim else (self.minimum, self.trim, -1.0)
        if value <= low or value > high:
            scaled = base if value <= low else base + 1.0
        else:
            slope = float32(1.0 / (high - low))
            scaled = float32(product(slope, value) + float32(base - product(slope, low)))
        return -scaled if self.reverse else scaled


def with_throttle_centred(channel: Channel) -> Channel:
    """QGroundControl's calibration leaves the throttle's trim where it is low: that does not count (updateParams)."""
    at_the_low_end = channel.trim == (channel.maximum if channel.reverse else channel.minimum)
    return channel._replace(trim=float(int(channel.minimum + channel.maximum) // 2)) if at_the_low_end else channel


def _compared(switches: ManualControlSwitches) -> tuple[int, ...]:
    return switches._replace(timestamp=0, terminate=0)


class RcUpdate:
    """Writes manual_control_rc and manual_control_switches."""

    def __init__(self, topics: Topics, parameters: Parameters) -> None:
        self._topics, self._parameters = topics, parameters
        self._version = -1
        self._input = topics.input_rc
        self._heard_us = 0
        self._signal_us: int | None = None
        """Since when there is a signal."""
        self._told_us = 0
        self._button = 0
        """Slot of the button that was pressed last, and since when it has been pressed message by message."""
        self._button_us: int | None = None
        self._seen = ManualControlSwitches()
        self._turned_us = 0
        self._knobs = [0.0, 0.0, 0.0]
        """Where the channels that turn parameters were when they last did."""

    def update(self) -> None:
        """When there is something new in input_rc, which is hardly ever; 83 Hz."""
        received = self._topics.input_rc
        if received is self._input:
            return
        before, self._input = self._input, received
        if self._parameters.version != self._version:
            self._version = self._parameters.version
            self._copy_parameters()
        if not self._is_regular(before, received):
            return
        channels = [channel.scaled(value) for channel, value in zip(self._channels, received.values, strict=False)]
        roll, pitch, yaw, throttle = (self._value(channels, number) for number in self._sticks)
        aux1, aux2, aux3, aux4, aux5, aux6 = (self._value(channels, number) for number in self._aux)
        is_due = received.values != before.values or received.timestamp - self._told_us > UNCHANGED_EVERY_US
        if self._is_calibrated and is_due:
            self._told_us = received.timestamp
            self._topics.manual_control_rc = ManualControlInput(
                received.timestamp, SOURCE_RC, roll, pitch, yaw, throttle, aux=(aux1, aux2, aux3, aux4, aux5, aux6)
            )
        switches = ManualControlSwitches(
            received.timestamp,
            self._mode_slot(received.timestamp, channels),
            *(self._switch(channels, number, threshold) for number, threshold in self._switches),
        )
        self._take_switches(switches)
        if received.timestamp - self._turned_us > PARAMETERS_EVERY_US:
            self._turned_us = received.timestamp
            self._turn_parameters(channels)

    def _take_switches(self, switches: ManualControlSwitches) -> None:
        """They count once two messages agree on them, at once where something changes, and are said again at 1 Hz.

        Whether it is to terminate is then said with the rest: PX4 does not compare that switch (rc_update.cpp,
        operator==).
        """
        seen, told = self._seen, self._topics.manual_control_switches
        self._seen = switches
        agreed = _compared(switches) == _compared(seen) and switches.timestamp - seen.timestamp < LONGEST_GAP_US
        is_new = _compared(switches) != _compared(told)
        if agreed and (is_new or switches.timestamp - told.timestamp >= SWITCHES_EVERY_US):
            self._topics.manual_control_switches = switches

    def _copy_parameters(self) -> None:
        value = self._parameters
        self._channels = tuple(
            Channel(
                float(value[f"RC{n}_MIN"]),
                float(value[f"RC{n}_TRIM"]),
                float(value[f"RC{n}_MAX"]),
                float(value[f"RC{n}_REV"]) < 0.0,
            )
            for n in range(1, CHANNELS + 1)
        )
        throttle = int(value["RC_MAP_THROTTLE"])
        if 1 <= throttle <= CHANNELS:
            channels = list(self._channels)
            channels[throttle - 1] = with_throttle_centred(channels[throttle - 1])
            self._channels = tuple(channels)
        sticks = ("RC_MAP_ROLL", "RC_MAP_PITCH", "RC_MAP_YAW", "RC_MAP_THROTTLE")
        self._sticks = tuple(int(value[name]) for name in sticks)
        self._is_calibrated = value["RC_CHAN_CNT"] > 0 and any(number > 0 for number in self._sticks)
        self._aux = tuple(int(value[f"RC_MAP_AUX{n}"]) for n in range(1, 7))
        switches = (
            ("RC_MAP_ARM_SW", "RC_ARMSWITCH_TH"),
            ("RC_MAP_RETURN_SW", "RC_RETURN_TH"),
            ("RC_MAP_LOITER_SW", "RC_LOITER_TH"),
            ("RC_MAP_OFFB_SW", "RC_OFFB_TH"),
            ("RC_MAP_KILL_SW", "RC_KILLSWITCH_TH"),
        )
        self._switches = (
            *((int(value[name]), float(value[threshold])) for name, threshold in switches),
            (int(value["RC_MAP_TERM_SW"]), TERMINATION_THRESHOLD),
            (int(value["RC_MAP_GEAR_SW"]), float(value["RC_GEAR_TH"])),
        )
        self._knob_channels = tuple(int(value[f"RC_MAP_PARAM{n}"]) for n in (1, 2, 3))
        self._mode_channel = int(value["RC_MAP_FLTMODE"])
        bits = int(value["RC_MAP_FLTM_BTN"])
        self._buttons = [channel for channel in range(1, CHANNELS + 1) if bits >> channel - 1 & 1][:MODE_SLOTS]
        self._failsafe_us = float(value["RC_FAILS_THR"])
        self._failsafe_channel = int(value["RC_MAP_FAILSAFE"]) or int(value["RC_MAP_THROTTLE"])

    def _turn_parameters(self, channels: list[float]) -> None:
        for knob, (channel, mapped) in enumerate(zip(self._knob_channels, self._topics.rc_parameter_map, strict=True)):
            if channel == NOT_MAPPED or mapped.name not in self._parameters:
                continue
            value = self._value(channels, channel)
            if abs(value - self._knobs[knob]) > SMALLEST_MOVE:
                self._knobs[knob] = value
                wanted = max(mapped.value_min, min(mapped.value_max, mapped.value0 + mapped.scale * value))
                self._parameters.set(mapped.name, self._as_px4_sets_it(mapped.name, wanted))

    def _as_px4_sets_it(self, name: str, value: float) -> float | int:
        """PX4 hands over a float whatever the parameter is: an integer gets its bits."""
        if self._parameters.is_float(name):
            return value
        bits: int = struct.unpack("<i", struct.pack("<f", value))[0]
        return bits

    def _is_regular(self, before: InputRc, received: InputRc) -> bool:
        """Whether there is a signal, for long enough, and its messages come one after the other alike."""
        if self._lost(received):
            self._signal_us = None
            return False
        if self._signal_us is None:
            self._signal_us = received.timestamp
        if received.timestamp - self._signal_us < REGAINED_US or len(received.values) != len(before.values):
            return False
        regular = received.timestamp - self._heard_us < LONGEST_GAP_US
        self._heard_us = received.timestamp
        return regular

    def _lost(self, received: InputRc) -> bool:
        if len(received.values) < FEWEST_CHANNELS:
            return True
        index, limit = self._failsafe_channel - 1, self._failsafe_us
        if limit <= 0.0 or not 0 <= index < len(received.values):
            return False
        channel, value = self._channels[index], received.values[index]
        return value < limit < channel.minimum or value > limit > channel.maximum

    @staticmethod
    def _value(channels: list[float], number: int) -> float:
        return channels[number - 1] if 1 <= number <= len(channels) else 0.0

    def _switch(self, channels: list[float], number: int, threshold: float) -> int:
        if number == NOT_MAPPED:
            return NOT_MAPPED
        value = float32(0.5 * self._value(channels, number) + 0.5)
        on = value < -threshold if threshold < 0.0 else value > threshold
        return ON if on else OFF

    def _mode_slot(self, now_us: int, channels: list[float]) -> int:
        """1..6, or 0 where modes are not mapped, or no button for one is pressed."""
        if self._mode_channel == NOT_MAPPED:
            return self._button_slot(now_us, channels) if self._buttons else 0
        lowest, highest = -1.0 - SLOT_MARGIN, 1.0 + SLOT_MARGIN
        place = (self._value(channels, self._mode_channel) - lowest) * MODE_SLOTS + 1.0 / MODE_SLOTS
        return min(int(place / (highest - lowest) + 1.0 / MODE_SLOTS) + 1, MODE_SLOTS)

    def _button_slot(self, now_us: int, channels: list[float]) -> int:
        """Slot of the first button that is pressed, once it has been for a moment."""
        slots = (slot for slot, number in enumerate(self._buttons, 1) if self._value(channels, number) > BUTTON_PRESSED)
        pressed = next(slots, 0)
        if not pressed or pressed != self._button:
            self._button, self._button_us = pressed or self._button, None
            return 0
        if self._button_us is None:
            self._button_us = now_us
        return pressed if now_us - self._button_us >= BUTTON_HELD_US else 0
