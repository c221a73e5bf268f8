"""Write docs/ros2.md: which of PX4's topics ROS 2 hears and tells, how often, and which fields say something.

    python tools/make_ros2_page.py

Topics come from the tables of autopilot/uxrce_dds_client, fields from a flight: an iris takes off, hovers, and lands.
"""

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.uxrce_dds_client import cdr
from sitl_emu.autopilot.uxrce_dds_client.dds_topics import (
    PUBLICATIONS,
    SOURCE,
    SUBSCRIPTIONS,
    Sample,
    Topic,
    dds_name,
)
from sitl_emu.autopilot.uxrce_dds_client.uxrce_dds_client import UxrceDdsClient
from sitl_emu.core.simulator_api import MemoryChannel
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.home import Home
from sitl_emu.world.simulator import VehicleSimulator

PAGE = Path(__file__).parents[1] / "docs" / "ros2.md"
HOME = Home(47.397742, 8.545594, 489.4, 0.0)
TICKS_PER_S = 250
COMMANDS = {8: (22, {}), 9: (400, {"param1": 1.0}), 40: (21, {})}
"""By second: take off, arm; land."""
FLIGHT_S = 60
NUMBERS = {topic.name: number for number, topic in enumerate(SUBSCRIPTIONS)}
BECOMES = {
    "offboard_control_mode": "what OFFBOARD controls, and that somebody does",
    "trajectory_setpoint": "OFFBOARD's setpoint, multicopters and rovers",
    "goto_setpoint": "OFFBOARD's setpoint, multicopters: a place, to which a smoothed trajectory leads",
    "rover_speed_setpoint": "a rover's speed, where OFFBOARD controls acceleration; there its heading counts, too",
    "rover_attitude_setpoint": "a rover's heading, where OFFBOARD controls attitude",
    "rover_rate_setpoint": "a rover's yaw rate, where OFFBOARD controls rates",
    "rover_throttle_setpoint": "a rover's throttle, where OFFBOARD controls attitude, rates, or thrust and torque",
    "rover_steering_setpoint": "a rover's steering, where OFFBOARD controls thrust and torque",
    "vehicle_attitude_setpoint": "OFFBOARD's setpoint, multicopters",
    "vehicle_rates_setpoint": "OFFBOARD's setpoint, multicopters",
    "vehicle_thrust_setpoint": "thrust, where OFFBOARD controls thrust and torque, multicopters",
    "vehicle_torque_setpoint": "torque, where OFFBOARD controls thrust and torque, multicopters; each moves the motors",
    "actuator_motors": "motors, where OFFBOARD controls direct actuators; NaN stops one",
    "actuator_servos": "servos, where OFFBOARD controls direct actuators",
    "aux_global_position": "a place for EKF2 (EKF2_AGP*n*_CTRL; EKF2_AGP*n*_ID has to be set at the start)",
    "onboard_computer_status": "a warning where the companion is hot (COM_CC_TEMP_WARN)",
    "telemetry_status": "heartbeats of a ground station, a companion, a parachute and others, heard by a link of yours",
    "vehicle_command": "a command as over MAVLink; the answer is `/fmu/out/vehicle_command_ack_v1`",
    "vehicle_visual_odometry": "a pose and velocity for EKF2 (EKF2_EV_CTRL)",
    "obstacle_distance": "obstacles for collision prevention (CP_DIST)",
    "distance_sensor": "height above ground (downward), or an obstacle (sideways)",
    "sensor_optical_flow": "flow for EKF2 (EKF2_OF_CTRL)",
    "manual_control_input": "sticks of a joystick",
    "register_ext_component_request": "a refusal: no slot is free",
    "setpoint_config": "a refusal: there is no such mode",
    "message_format_request": "the message's hash, of the messages in these tables",
}
WITHOUT_EFFECT = {
    "no mode of one's own is registered (commander/ModeManagement.cpp)": (
        "unregister_ext_component",
        "config_overrides_request",
        "arming_check_reply",
        "mode_completed",
        "vehicle_command_mode_executor",
    ),
    "in PX4 attitude_estimator_q and local_position_estimator alone read it, which don't run where EKF2 does": (
        "vehicle_mocap_odometry",
    ),
    "for fixed wings (fw_lateral_longitudinal_control)": (
        "fixed_wing_longitudinal_setpoint",
        "fixed_wing_lateral_setpoint",
        "longitudinal_control_configuration",
        "lateral_control_configuration",
    ),
    "OFFBOARD writes it over itself, by trajectory_setpoint (AckermannOffboardMode.cpp)": ("rover_position_setpoint",),
    "no output of ours carries a landing gear (FunctionLandingGear.hpp, PWM_MAIN_FUNC*n* 400)": ("landing_gear",),
}
"""Of what is taken and changes nothing, why."""
HEAD = f"""# ROS 2

Made by `tools/make_ros2_page.py`; topics and messages by {SOURCE}.

`sitl-emu launch iris --dds`, or `run … --dds` (`pip install 'sitl-emu[ros2]'`: Cyclone DDS, EPL-2.0 or EDL-1.0), lets
each vehicle speak DDS as a PX4 with its uXRCE-DDS agent does; there is no agent to start.

- **Names** are `/fmu/out/…` and `/fmu/in/…`, for instance *I* above 0 `/px4_I/fmu/…`, with `_vN` where a message has a
  version. `PX4_UXRCE_DDS_NS` names another namespace, or (empty) none, of the one vehicle there is. Types are those of
  `px4_msgs` for this version of PX4.
- **Domain**: `ROS_DOMAIN_ID`, else 0: PX4's start script (rcS) sets UXRCE_DDS_DOM_ID so at each start, whatever it was.
  Cyclone's own settings (`CYCLONEDDS_URI`) hold.
- **QoS** as PX4's client asks for it: published best effort, transient local, last 1; taken best effort, volatile.
- **Times** are moved to the computer's clock, as by PX4's default UXRCE_DDS_SYNCT 1: what is published bears Unix time,
  and in what is taken 0 is now and nothing is later than now. At another `--speed` than 1 time is simulated: the date
  at which the launch began, and what has passed in the simulation since, for all its vehicles. In a `run` it is so at
  any speed, from the scenario's date, so that the same seed tells the same times.
- **`/clock`** (`rosgraph_msgs/Clock`, 50 Hz of simulated time) tells that time, for nodes with `use_sim_time`: a launch
  file of yours is the same at any speed. Of a launch in several processes it is the first one's.
- **Service** `/fmu/vehicle_command` (`px4_msgs/srv/VehicleCommand`): the reply is the first answer to the command; as
  in PX4 one request is waited for at a time, the newest, and one for another system is never answered. How replies
  find who asked is each rmw's own: spoken is rmw_cyclonedds's way, so clients need
  `RMW_IMPLEMENTATION=rmw_cyclonedds_cpp`. PX4's agent speaks rmw_fastrtps's; of such a client a line of the output says
  that it is not understood. On either rmw `/fmu/in/vehicle_command` works, and `/fmu/out/vehicle_command_ack_v1` has
  the answer.
- **Rates** are PX4's upper limits; a state comes when it changes, and twice a second.
- **Latency**: from a node's `write` a setpoint takes 2 to 4 ms to the autopilot and 7 to 9 to the motors (medians; nine
  of ten within 9 to 13, and 17 to 21), on two cores with a load of 7 (`tools/bench_dds.py 100`, four times).
- **Processor**: a hovering iris took 8.3 % of a core, and one beside it with `--dds` 9.9 %, and its agent 1.9 %
  (`tools/bench_dds_cpu.py`, in real time; compiled, two cores with a load of 7, nobody listening).

What was tried: Cyclone DDS on the other side, by types of its own, and `examples/ros2_offboard.py` and
`examples/ros2_detector.py` with a stand-in for rclpy (`tests/interop/rclpy_stand_in`). A ROS 2 installation was not to
be had where this was made; the service's layout is rmw_cyclonedds's by its source. Not there: registered modes.
"""

NOTES = """A mode of one's own (`register_ext_component_request`) is answered as PX4 answers where no slot is free: no
success, ids of -1.

In OFFBOARD a setpoint counts that came since the mode was entered; until then the last one goes on, as in PX4, where
`offboard_control_mode` alone is the signal. By direct actuators nobody asks for thrust: a multicopter then counts as in
the air from arming on, and is disarmed by force (MulticopterLandDetector.cpp). Disarmed or killed its motors stop, as
PX4's do on hardware; PX4's simulated outputs keep what they were told last until they are told more (PWMSim.cpp).

What PX4 would fly with, and we do not take: an attitude without a direction, a thrust or torque that is no number, and
setpoints outside OFFBOARD, where in PX4 they mix with those of its own controllers.
"""

SENSORS = """## The world's sensors

`run … --dds`, and `launch … --world WORLD --dds`, tell ROS 2 of the clock, the vehicles' sensors and where they are in
ROS's own messages (types and hashes of ROS 2 Jazzy), from a process of its own that nobody waits for. Topics of sensors
lie in the vehicle's namespace, as PX4's do; what nobody has subscribed to is not made. Names that are ours are marked;
so are all frames' prefixes: NAME is the vehicle's in the scenario, in a launch MODEL-INSTANCE.

**In a launch** there are `/clock`, with `--world` `/tf`, `/tf_static` and `range` as well, and with `--camera` those of
`camera/…`, at the rate of the vehicle's data. `--camera` sends video, too, and needs PyAV (`pip install
'sitl-emu[ros2,video]'`). A vehicle of your own whose vehicle.toml has a table `[depth]` or `[lidar]`, with the figures
that a scenario gives them, has `depth_camera/…` and `lidar/…` with `--world`; in a launch they tell ROS 2 alone, and
the autopilot of no obstacles. None of ours lists any.

| topic | message | Hz | frame |
| --- | --- | --- | --- |
| `/clock` | rosgraph_msgs/Clock | 50 | |
| `/tf` | tf2_msgs/TFMessage | 50 | `map` → `NAME/base_link`; a gimbal's `NAME/camera_link` |
| `/tf_static` | tf2_msgs/TFMessage | once | all other sensors, and optical frames |
| `camera/image_raw` | sensor_msgs/Image, bgr8 | `rate_hz` | `NAME/camera_optical_frame` |
| `camera/image_raw/compressed` | sensor_msgs/CompressedImage, JPEG 95 | `rate_hz` | the same |
| `camera/camera_info` | sensor_msgs/CameraInfo, plumb_bob, follows zoom | `rate_hz` | the same |
| `depth_camera/image_raw` | sensor_msgs/Image, 32FC1, m | `rate_hz` | `NAME/depth_camera_optical_frame` |
| `depth_camera/points` | sensor_msgs/PointCloud2, as many as pixels | `rate_hz` | the same |
| `depth_camera/camera_info` | sensor_msgs/CameraInfo | `rate_hz` | the same |
| `lidar/points` (ours) | sensor_msgs/PointCloud2 | `rate_hz` | `NAME/lidar_link` |
| `lidar/scan` (ours) | sensor_msgs/LaserScan, where the lidar has one row, level | `rate_hz` | the same |
| `range` (ours) | sensor_msgs/Range, of the downward range finder | its own | `NAME/range_link`, x along the beam |

- **Time**: in a run `/clock` is its date plus simulated time, and so are all stamps, PX4's too; in a launch they are
  stamped as PX4's topics there (Times, above). A node with `use_sim_time` runs at the run's speed; the run does not
  wait for it, so one that must hear every frame wants `--speed 1`. A frame comes when it reaches a companion
  (`latency_s`), in a launch when it is drawn, and bears the time at which it was taken. A launch does not wait for
  its cameras and lidars: where a frame is not there in time, the next is left out. It tells nothing before its
  vehicles are armable, and while one that is alone reboots: until then time goes faster than asked for.
  At the speed 1 on a machine that can't follow, PX4's time synchronisation jumps (by 0.1 s and more), and the stamps of
  its topics with it, back as well. `/clock` stands still then, and those of the sensors and of `/tf` go on by a
  twentieth of the time, until it has caught up: they never go back.
- **Axes**: `map` is east, north, up from the world's origin, bodies are forward, left, up (REP 103, 105). `/tf` is the
  simulator's truth, as Gazebo's poses are; what the vehicle knows of itself is `/fmu/out/vehicle_odometry`.
- **QoS**: sensors reliable, volatile, last 5, so that best effort readers hear them as well as others (REP 2003);
  `/clock`, `/tf` and `/tf_static` as rclcpp and tf2_ros have them.
- The process takes 4 % of a core and 72 MB while nobody listens, 7 % where all is heard of an iris with a camera
  (640 × 480, 5 Hz, raw and compressed), a depth camera and a lidar; every frame and every time came, at a load of 8.
  Of a launched iris with `--camera` (640 × 480, 15 Hz) it takes 1.6 % and 71 MB, and 6.5 % and 78 MB where all is
  heard, which was 15.0 pictures and 50 times `/tf` a second (20 s, two cores at a load of 4).
- A launch's depth camera (64 × 48) and lidar (16 × 180) at 5 Hz take 2.5 % and 65 MB each, and came 4.9 times a second
  (20 s, two cores at a load of 8).
- When that process dies, a run ends; a launch says so in a line, and its vehicles fly on.
- A scenario without a `companion:` is a world whose sensors ROS 2 hears, for as long as its `time_limit_s` says.
"""


def flown() -> dict[str, set[str]]:
    """Of each topic that was published in a flight, the fields that said something: neither 0 nor NaN for once."""
    iris = vehicles.load("iris")
    simulator = VehicleSimulator(iris, HOME, seed=1, terrain=FlatGround())
    autopilot, channel = Autopilot(iris.airframe, instance=0), MemoryChannel()
    client = autopilot.start_uxrce_dds_client()
    found: dict[str, set[str]] = {}
    actuators = None
    for tick in range(FLIGHT_S * TICKS_PER_S):
        second, rest = divmod(tick, TICKS_PER_S)
        if rest == 0 and second in COMMANDS:
            command(client, autopilot.now_us, *COMMANDS[second])
        channel.simulator.send(simulator.tick(actuators))
        channel.autopilot.send(autopilot.step(channel.autopilot.receive()))
        actuators = channel.simulator.receive()
        for link in autopilot.mavlink.links:
            link.outbox.clear()
        for number, data in client.outbox:
            topic = PUBLICATIONS[number]
            fields = cdr.Reader(topic.type).read(data)
            found.setdefault(topic.name, set()).update(name for name, value in fields.items() if says(value))
        client.outbox.clear()
    return found


def command(client: UxrceDdsClient, now_us: int, number: int, more: Mapping[str, float]) -> None:
    """Give a command from ROS 2."""
    nan = {f"param{n}": math.nan for n in range(4, 8)}
    fields = {"command": number, "target_system": 1, "target_component": 1, "source_system": 1, **nan, **more}
    client.on_sample(now_us, Sample(NUMBERS["vehicle_command"], cdr.Writer("VehicleCommand").write(**fields)))


def says(value: Any) -> bool:
    """Whether a field's value is neither 0 nor NaN; of an array's any."""
    values = value if isinstance(value, tuple | bytes) else (value,)
    return any(each and each == each for each in values)


def names(topics: Iterable[str]) -> str:
    """A list for people."""
    return ", ".join(f"`{name}`" for name in topics)


def row(topic: Topic, said: set[str]) -> str:
    """A published topic."""
    paths = [place.path for place in cdr.places(topic.type)]
    empty = [path for path in paths if path not in said]
    name = dds_name(topic, "out").removeprefix("rt")
    rate_hz, filled = round(1e6 / topic.interval_us), f"{len(said)} of {len(paths)}"
    return f"| `{name}` | {topic.type} | {rate_hz} | {filled} | {names(empty)} |"


def page(published: Mapping[str, set[str]]) -> str:
    """The page, with what `flown` found."""
    silent = [topic.name for topic in PUBLICATIONS if topic.name not in published]
    assert {topic.name for topic in SUBSCRIPTIONS} == BECOMES.keys() | set().union(*WITHOUT_EFFECT.values())
    lines = [
        HEAD,
        "## Published",
        "",
        "Fields: how many said something, and which stayed 0 or NaN, in a flight of an iris: take-off, hover, landing.",
        "",
        "| topic | message | Hz at most | fields | 0 or NaN throughout |",
        "| --- | --- | --- | --- | --- |",
        *(row(topic, published[topic.name]) for topic in PUBLICATIONS if topic.name in published),
        "",
        f"Announced, and silent in that flight: {names(silent)}. Of these come when there is something to tell: "
        "`manual_control_setpoint`, `input_rc`, `transponder_report`, `gimbal_device_attitude_status`, `wind`, "
        "the replies, and in real time `timesync_status`, once a second. The others never do.",
        "",
        "## Taken",
        "",
        "| topic | message | becomes |",
        "| --- | --- | --- |",
        *(
            f"| `{dds_name(topic, 'in').removeprefix('rt')}` | {topic.type} | {BECOMES[topic.name]} |"
            for topic in SUBSCRIPTIONS
            if topic.name in BECOMES
        ),
        "",
        "Taken without effect, in PX4 on these vehicles as here, but for the landing gear:",
        "",
        *(f"- {names(topics)}: {why}" for why, topics in WITHOUT_EFFECT.items()),
        "",
        NOTES,
        SENSORS.rstrip(),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(flown()))
