"""docs/ros2.md is what its generator makes of a flight today: every topic, its rate, and the fields that are filled."""

import importlib
from pathlib import Path

make_ros2_page = importlib.import_module("tools.make_ros2_page")
PAGE = Path(__file__).parents[2] / "docs" / "ros2.md"


def test_the_page_tells_of_the_fields_that_a_flight_fills() -> None:
    assert PAGE.read_text() == make_ros2_page.page(make_ros2_page.flown()), "run tools/make_ros2_page.py"
