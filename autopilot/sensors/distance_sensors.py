"""Distance sensors, as their listeners find them: our own first, then one of each link, in the order in which they
spoke first (PX4: instances of uORB's distance_sensor).
"""

from typing import Final

from sitl_emu.autopilot.topics import DistanceSensorSample, Topics

DOWNWARD: Final = 25
"""distance_sensor.orientation."""
FRESH_US: Final = 100_000
"""One that has not spoken for so long is not chosen."""
SILENT_US: Final = 1_000_000
"""After so long without a word another one is looked for."""


def distance_sensors(topics: Topics) -> tuple[DistanceSensorSample, ...]:
    """The newest sample of each; our own keeps its place where there is none (timestamp 0)."""
    return (topics.distance_sensor, *topics.distance_sensors_outside)


class DownwardSensor:
    """The sensor that tells the height above ground: the first that looks down and speaks, until it falls silent.

    As EKF2::UpdateRangeSample and VehicleOpticalFlow::UpdateDistanceSensor: the sample by which one is chosen is not
    used, and what looks elsewhere by the same link passes.
    """

    def __init__(self) -> None:
        self._sensors: tuple[DistanceSensorSample, ...] = ()
        self._chosen = -1
        self._spoke_us = 0

    def new_sample(self, now_us: int, sensors: tuple[DistanceSensorSample, ...]) -> DistanceSensorSample | None:
        """What it has said since the last time; None for nothing."""
        before, self._sensors = self._sensors, sensors
        if now_us - self._spoke_us > SILENT_US:
            self._chosen = -1
        if self._chosen < 0:
            for number, sensor in enumerate(sensors):
                if sensor.orientation == DOWNWARD and sensor.timestamp > 0 and now_us - sensor.timestamp < FRESH_US:
                    self._chosen, self._spoke_us = number, sensor.timestamp
                    break
            return None
        sample = sensors[self._chosen]
        if sample.orientation != DOWNWARD or (self._chosen < len(before) and sample is before[self._chosen]):
            return None
        self._spoke_us = now_us
        return sample
