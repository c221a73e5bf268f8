"""The process that tells ROS 2 of a run or of a launch: the clock, the vehicles' sensors, and where all these are.

It is told by the world process at every barrier (`ros/seen.py`), or by a launch (`ros_line.py`), and takes frames from
the feeds' shared memory; nobody waits for it. What nobody has subscribed to is not made into a message. Times are the
run's date, as in PX4's messages.
"""

import select

from cyclonedds.core import DDSException
from cyclonedds.domain import DomainParticipant

from sitl_emu.core.frame_ring import RingError
from sitl_emu.run import dds_socket
from sitl_emu.run.configs import RosConfig
from sitl_emu.run.control import ControlChannel
from sitl_emu.run.memory import settle
from sitl_emu.run.messages import Message, Ready, Seen, Start
from sitl_emu.run.process import StartError, main
from sitl_emu.run.ros import frames
from sitl_emu.run.ros.messages import stamp
from sitl_emu.run.ros.publisher import CLOCK, TF, TF_STATIC, Publisher
from sitl_emu.run.ros.vehicle import RosVehicle
from sitl_emu.run.trouble import Trouble


def run(config: RosConfig, control: ControlChannel) -> None:
    """Publish what is told until the run ends."""
    control.expect(Start)
    try:
        _publish(config, control)
    except (DDSException, RingError, Trouble) as error:
        raise StartError(f"ROS 2: {error}") from None


def _publish(config: RosConfig, control: ControlChannel) -> None:
    """Raises DDSException, RingError and Trouble."""
    participant = DomainParticipant(dds_socket.domain())
    vehicles = [RosVehicle(participant, each, config.start_us) for each in config.vehicles]
    clock = Publisher(participant, "clock", "rosgraph_msgs/Clock", CLOCK) if config.tells_clock else None
    tf = Publisher(participant, "tf", "tf2_msgs/TFMessage", TF)
    tf_static = Publisher(participant, "tf_static", "tf2_msgs/TFMessage", TF_STATIC)
    static = [transform for vehicle in vehicles for transform in vehicle.static_transforms()]
    tf_static.publish(frames.tf_message(config.start_us, static))
    settle()
    control.send(Ready())
    while isinstance(told := _next(control), Seen):
        time_us = config.start_us + told.now_us
        if clock is not None and clock.is_heard:
            clock.publish({"clock": stamp(time_us)})
        both = list(zip(vehicles, told.vehicles, strict=True))
        if tf.is_heard:
            moving = [each for vehicle, seen in both for each in vehicle.transforms(seen)]
            tf.publish(frames.tf_message(time_us, moving))
        for vehicle, seen in both:
            vehicle.publish(told.now_us, seen)


def _next(control: ControlChannel) -> Message:
    """What is told next, however long that takes: a launch may stand still. Raises ProcessLostError."""
    select.select([control], [], [])
    return control.receive()


if __name__ == "__main__":
    main(run, RosConfig)
