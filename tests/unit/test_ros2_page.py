"""docs/ros2.md tells of every topic once, where it belongs."""

import importlib
from pathlib import Path

from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import PUBLICATIONS, SUBSCRIPTIONS, dds_name
from sitl_emu.autopilot.uxrce_dds_client.subscriptions import Subscriptions
from sitl_emu.vehicles import load

make_ros2_page = importlib.import_module("tools.make_ros2_page")
PAGE = (Path(__file__).parents[2] / "docs" / "ros2.md").read_text()


def test_what_is_taken_is_what_somebody_handles() -> None:
    autopilot = Autopilot(load("iris").airframe, 0)
    handlers = Subscriptions(autopilot.topics, 1, lambda _now, _command: None, lambda _now, _reply: None).handlers
    assert set(handlers) == set(make_ros2_page.BECOMES)


def test_the_page_tells_of_every_topic() -> None:
    published, _, taken = PAGE.partition("## Taken")
    table = {line.split("`")[1]: line for line in published.splitlines() if line.startswith("| `/fmu")}
    silent = published.partition("Announced, and silent")[2].partition(". Of these")[0]
    for topic in PUBLICATIONS:
        line = table.pop(dds_name(topic, "out").removeprefix("rt"), None)
        assert (line is None) == (f"`{topic.name}`" in silent)
        assert line is None or f"| {topic.type} | {round(1e6 / topic.interval_us)} |" in line
    assert not table
    for topic in SUBSCRIPTIONS:
        name = dds_name(topic, "in").removeprefix("rt")
        assert (f"| `{name}` |" in taken) == (topic.name in make_ros2_page.BECOMES)
        assert f"`{topic.name}`" in taken or f"| `{name}` |" in taken
