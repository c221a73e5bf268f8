"""Which of several distance sensors tells the height above ground, as EKF2::UpdateRangeSample chooses it."""

from sitl_emu.autopilot.sensors.distance_sensors import DownwardSensor, distance_sensors
from sitl_emu.autopilot.topics import DistanceSensorSample, Topics

AHEAD, DOWN = 0, 25


class Sensors:
    """Sensors by number, 0 our own, and who listens to them."""

    def __init__(self) -> None:
        self.topics, self.chosen = Topics(), DownwardSensor()
        self.topics.distance_sensors_outside = (DistanceSensorSample(), DistanceSensorSample())

    def say(self, now_us: int, number: int, orientation: int = DOWN) -> bool:
        """One sensor measures; whether that is what is listened to."""
        sample = DistanceSensorSample(now_us, 1.0, 0.2, 12.0, orientation)
        if number:
            outside = list(self.topics.distance_sensors_outside)
            outside[number - 1] = sample
            self.topics.distance_sensors_outside = tuple(outside)
        else:
            self.topics.distance_sensor = sample
        return self.chosen.new_sample(now_us, distance_sensors(self.topics)) is sample


def test_the_first_that_looks_down_is_listened_to_after_the_sample_that_shows_it() -> None:
    sensors = Sensors()
    assert not sensors.say(1_000_000, 1, AHEAD)
    assert not sensors.say(1_010_000, 2)
    assert sensors.say(1_020_000, 2)
    assert not sensors.say(1_030_000, 0), "another one speaks, too"
    assert not sensors.say(1_040_000, 2, AHEAD), "by the same link"
    assert sensors.say(1_050_000, 2)


def test_after_a_second_of_silence_another_is_chosen() -> None:
    sensors = Sensors()
    sensors.say(1_000_000, 0)
    assert sensors.say(1_010_000, 0)
    assert not sensors.say(2_000_000, 1)
    assert not sensors.say(2_020_000, 1), "chosen now"
    assert sensors.say(2_040_000, 1)
    assert not sensors.say(2_060_000, 0), "back too late"


def test_one_that_spoke_long_ago_is_not_chosen() -> None:
    sensors = Sensors()
    sensors.say(1_000_000, 0)
    assert not sensors.say(3_000_000, 1)
    assert sensors.say(3_020_000, 1)
