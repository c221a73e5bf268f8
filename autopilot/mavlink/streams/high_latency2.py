"""HIGH_LATENCY2: the vehicle in one small message, for slow links (PX4: streams/HIGH_LATENCY2.hpp).

On request: PX4's SITL has no link of the mode that streams it (MAVLINK_MODE_IRIDIUM). Once it was asked for on a link,
what is told of speeds, throttle, wind, temperature, charge and accuracy is of all the time since the last message
there: averages, or the greatest. What brought nothing new since then is told as unknown, or 0; in the first message
there all but the charge is, as nobody knows yet how often something comes.
"""

import math
from typing import Any, Final

from sitl_emu.autopilot.commander.custom_mode import custom_mode_of
from sitl_emu.autopilot.mavlink.context import Context
from sitl_emu.autopilot.mavlink.streams import Fields
from sitl_emu.core import attitude
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.c_types import truncated

ID = mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2
AT_ONCE: Final = True
"""It is sent when its stream begins (MavlinkStreamHighLatency2 resets _last_sent)."""
SPEED_SCALE: Final = 5.0
CLIMB_SCALE: Final = 10.0
ERROR_SCALE: Final = 10.0
HEADING_SCALE: Final = 0.5
"""Units of the message: 1/5 m/s, dm/s, dm, 2 degrees."""
UNKNOWN_TEMPERATURE: Final = -128
UNUSED: Final = -128
UINT8_MAX: Final = 255
UNKNOWN_ITEM: Final = 65535
INT16_MAX: Final = 32767
LOW: Final = 1
"""battery_status.warning."""
MAIN_AND_SUB_SHIFT: Final = 16
"""custom_mode here is the upper half of the HEARTBEAT's: main mode below, sub mode above."""
FAILURES = (
    (mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, mavlink.HL_FAILURE_FLAG_ABSOLUTE_PRESSURE),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL, mavlink.HL_FAILURE_FLAG_3D_ACCEL),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO, mavlink.HL_FAILURE_FLAG_3D_GYRO),
    (mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG, mavlink.HL_FAILURE_FLAG_3D_MAG),
)
"""What is enabled and not healthy, and how it is told here."""

WINDOW_S: Final = 60.0
"""What an average takes alike, then the older ones fade (mavlink_simple_analyzer.h)."""
LEAST_RATE_HZ: Final = 1.0
"""With less nothing counts (SimpleAnalyzer::add_value)."""
RATE_WEIGHT: Final = 0.03
"""Of the newest interval in the rate of updates (MavlinkStreamHighLatency2::update_data)."""


class Analyzer:
    """PX4's SimpleAnalyzer: the average of what was added, or the greatest."""

    def __init__(self, greatest: bool = False) -> None:
        self._greatest = greatest
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self.result, self.count = 0.0, 0

    def add(self, value: float, rate_hz: float) -> None:
        """One more, of values that come at `rate_hz`; an average of what is no number makes it begin anew."""
        if not self._greatest:
            self.result += (value - self.result) / (self.count + 1)
        elif value > self.result:
            self.result = value
        if rate_hz > LEAST_RATE_HZ and self.count < rate_hz * WINDOW_S:
            self.count += 1
        if not math.isfinite(self.result):
            self.reset()

    def scaled(self, scale: float, least: int, most: int, unknown: int = 0) -> int:
        """The result in units of the message, held within the field; `unknown` where nothing counts."""
        return self.scaled_anyhow(scale, least, most) if self.count else unknown

    def scaled_anyhow(self, scale: float, least: int, most: int) -> int:
        """Whether or not anything counts."""
        value = self.result * scale
        return max(least, min(most, int(value + math.copysign(0.5, value))))


class Analysis:
    """What has come since the last message on a link."""

    def __init__(self, context: Context) -> None:
        self._topics = context.topics
        self._seen: dict[str, Any] = {}
        self.ground_speed, self.wind_speed, self.throttle = Analyzer(), Analyzer(), Analyzer()
        self.temperature, self.remaining = Analyzer(), Analyzer()
        self.climb, self.eph, self.epv = Analyzer(True), Analyzer(True), Analyzer(True)
        self._mission_us = -1
        self._updated_us, self._rate_hz = 0, 0.0

    def reset(self) -> None:
        """A message was made."""
        self._mission_us = self._topics.mission_result.timestamp
        for analyzer in (self.ground_speed, self.wind_speed, self.throttle, self.temperature):
            analyzer.reset()
        for analyzer in (self.remaining, self.climb, self.eph, self.epv):
            analyzer.reset()

    def mission_item(self) -> int:
        """The current one, if anything has become of the mission since the last message."""
        mission = self._topics.mission_result
        return UNKNOWN_ITEM if mission.timestamp == self._mission_us else mission.seq_current

    def update(self, now_us: int) -> None:
        """Take what is new. How often that is looks rare at first: the interval before the first is that from boot."""
        topics = self._topics
        if now_us > self._updated_us:
            newest_hz = 1e6 / (now_us - self._updated_us)
            self._rate_hz += (newest_hz - self._rate_hz) * RATE_WEIGHT
            self._updated_us = now_us
        rate_hz = self._rate_hz
        if self._is_new("battery_status", topics.battery_status):
            self.remaining.add(topics.battery_status.remaining, rate_hz)
        if self._is_new("vehicle_local_position", topics.vehicle_local_position):
            local = topics.vehicle_local_position
            self.climb.add(abs(local.vz), rate_hz)
            self.ground_speed.add(math.hypot(local.vx, local.vy), rate_hz)
        if self._is_new("sensor_gps", topics.sensor_gps):
            self.eph.add(topics.sensor_gps.eph, rate_hz)
            self.epv.add(topics.sensor_gps.epv, rate_hz)
        if self._is_new("vehicle_status", topics.vehicle_status):
            self.throttle.add(-topics.vehicle_thrust_setpoint.xyz[2] if topics.vehicle_status.armed else 0.0, rate_hz)
        if self._is_new("wind", topics.wind):
            self.wind_speed.add(math.hypot(topics.wind.windspeed_north, topics.wind.windspeed_east), rate_hz)
        if self._is_new("vehicle_air_data", topics.vehicle_air_data):
            self.temperature.add(topics.vehicle_air_data.ambient_temperature, rate_hz)

    def _is_new(self, topic: str, record: Any) -> bool:
        if record.timestamp == 0 or self._seen.get(topic) is record:
            return False
        self._seen[topic] = record
        return True


def fields(now_us: int, context: Context, analysis: Analysis) -> Fields:
    """Accuracies are the receiver's, the climb has no sign, and the target's height and distance are a fixed wing's
    alone (0), as in PX4.
    """
    topics = context.topics
    position, battery, wind = topics.vehicle_global_position, topics.battery_status, topics.wind
    told = (
        now_us // 1000 & 0xFFFFFFFF,
        truncated(position.lat * 1e7) if math.isfinite(position.lat) else 0,
        truncated(position.lon * 1e7) if math.isfinite(position.lon) else 0,
        custom_mode_of(topics.vehicle_status.nav_state) >> MAIN_AND_SUB_SHIFT,
        _altitude(position.alt),
        0,
        0,
        analysis.mission_item(),
        _failure_flags(context),
        context.mav_type,
        mavlink.MAV_AUTOPILOT_PX4,
        _direction(attitude.heading(topics.vehicle_attitude.q)),
        _direction(attitude.heading(topics.vehicle_attitude_setpoint.q_d)),
        analysis.throttle.scaled(100.0, 0, UINT8_MAX),
        0,
        0,
        analysis.ground_speed.scaled(SPEED_SCALE, 0, UINT8_MAX),
        analysis.wind_speed.scaled(SPEED_SCALE, 0, UINT8_MAX),
        _direction(math.atan2(wind.windspeed_east, wind.windspeed_north)),
        analysis.eph.scaled(ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        analysis.epv.scaled(ERROR_SCALE, 0, UINT8_MAX, UINT8_MAX),
        analysis.temperature.scaled(1.0, -128, 127, UNKNOWN_TEMPERATURE),
        analysis.climb.scaled(CLIMB_SCALE, -128, 127),
        analysis.remaining.scaled_anyhow(100.0, -128, 127) if battery.connected else -1,
        UNUSED,
        UNUSED,
        UNUSED,
    )
    analysis.reset()
    return told


def _altitude(metres: float) -> int:
    if not math.isfinite(metres):
        return 0
    return max(-INT16_MAX - 1, min(INT16_MAX, int(metres + math.copysign(0.5, metres))))


def _direction(radians: float) -> int:
    """In units of two degrees; 0 of what is no number."""
    return int(math.degrees(radians) % 360.0 * HEADING_SCALE) if math.isfinite(radians) else 0


def _failure_flags(context: Context) -> int:
    """HL_FAILURE_FLAG of all that is not well; sticks and offboard that nobody uses are lost as well, as in PX4."""
    topics = context.topics
    report, failsafe, status = topics.health_report, topics.failsafe_flags, topics.estimator_status
    failing = report.enabled & ~report.health
    flags: int = sum(told for bit, told in FAILURES if failing & bit)
    unfit_gps = status.gps_check_fail_flags > 0
    for is_so, flag in (
        (topics.battery_status.warning > LOW, mavlink.HL_FAILURE_FLAG_BATTERY),
        (unfit_gps, mavlink.HL_FAILURE_FLAG_GPS),
        (unfit_gps or status.filter_fault_flags > 0, mavlink.HL_FAILURE_FLAG_ESTIMATOR),
        (topics.geofence_result.breached, mavlink.HL_FAILURE_FLAG_GEOFENCE),
        (failsafe.manual_control_signal_lost, mavlink.HL_FAILURE_FLAG_RC_RECEIVER),
        (failsafe.offboard_control_signal_lost, mavlink.HL_FAILURE_FLAG_OFFBOARD_LINK),
        (failsafe.mission_failure, mavlink.HL_FAILURE_FLAG_MISSION),
        (failsafe.fd_motor_failure, mavlink.HL_FAILURE_FLAG_ENGINE),
    ):
        flags |= flag if is_so else 0
    return flags
