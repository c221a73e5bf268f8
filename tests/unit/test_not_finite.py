"""No number without sense that comes in over MAVLink goes too far: each message that feeds estimator, controllers or
modes, with any of its floats NaN, infinite or huge, leaves the vehicle's state and its outputs finite. Setpoints of
attitude, rates and thrust alone may be told as they came, as PX4 does."""

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.autopilot.constants import NavState
from sitl_emu.autopilot.topics import Topics
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import HilSensor, SimulatorMessage
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

GCS = 0
HOME = Home(47.397742, 8.545594, 489.4, 0.0)
FED = (
    "ATT_POS_MOCAP",
    "DISTANCE_SENSOR",
    "FOLLOW_TARGET",
    "GLOBAL_POSITION_SENSOR",
    "LANDING_TARGET",
    "OBSTACLE_DISTANCE",
    "ODOMETRY",
    "OPTICAL_FLOW_RAD",
    "SET_ATTITUDE_TARGET",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "SET_POSITION_TARGET_LOCAL_NED",
    "VISION_POSITION_ESTIMATE",
)
"""Messages with floats that an estimator, a filter or a controller takes."""
SENSELESS = st.sampled_from([math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 0.0, 1.0])
WIRED = {"EKF2_EV_CTRL": 15, "EKF2_OF_CTRL": 1, "CP_DIST": 5.0, "EKF2_RNG_CTRL": 1}
WIRED |= {"EKF2_AGP0_ID": 1, "EKF2_AGP0_CTRL": 3}
NAMED = {"target_system": 1, "target_component": 1, "type_mask": 0, "coordinate_frame": 1, "frame": 1, "frame_id": 1}


class Flight:
    """A hexacopter that stands armed, as its controllers see it; modes are set by hand."""

    def __init__(self) -> None:
        data = vehicles.load("sihsim_hex")
        self.autopilot = Autopilot({**data.airframe, **WIRED}, 0)
        self.simulator = VehicleSimulator(data, HOME, seed=1, terrain=FlatGround())
        self.encoder: Any = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self.controls: Any = None
        self.run(4.0)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.004)):
            messages: list[SimulatorMessage] = self.simulator.tick(self.controls)
            self.controls = self.autopilot.step(messages)
            for link in self.autopilot.mavlink.links:
                link.outbox.clear()

    def tell(self, message: Any) -> None:
        self.autopilot.on_datagram(GCS, bytes(message.pack(self.encoder)))


@pytest.fixture(scope="module")
def flight() -> Flight:
    flown = Flight()
    flown.tell(mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0))
    flown.run(0.1)
    assert flown.autopilot.topics.vehicle_status.armed
    return flown


def message_of(name: str, floats: list[float]) -> Any:
    """A message whose floats are those given, over and over, and whose other fields are plausible."""
    kind = mavlink.mavlink_map[getattr(mavlink, f"MAVLINK_MSG_ID_{name}")]
    values: dict[str, Any] = {}
    taken, lengths = 0, dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    for field, ctype in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = lengths[field]
        if ctype == "float":
            told = [floats[(taken + n) % len(floats)] for n in range(max(length, 1))]
            taken += len(told)
            values[field] = told if length else told[0]
        elif ctype == "char":
            values[field] = b""
        else:
            whole = NAMED.get(field, 1)
            values[field] = [whole] * length if length else whole
    return kind(**values)


def is_finite(topics: Topics) -> bool:
    local, attitude = topics.vehicle_local_position, topics.vehicle_attitude
    state = (local.x, local.y, local.z, local.vx, local.vy, local.vz, local.heading, *attitude.q)
    torque = topics.vehicle_torque_setpoint.xyz
    return all(map(math.isfinite, (*state, *torque, *topics.actuator_outputs.controls)))


@pytest.mark.parametrize("name", FED)
@settings(max_examples=8, deadline=None)
@given(floats=st.lists(SENSELESS, min_size=3, max_size=7), mode=st.sampled_from(["OFFBOARD", "FOLLOW", "POSITION"]))
def test_a_senseless_number_goes_no_farther_than_its_message(
    flight: Flight, name: str, floats: list[float], mode: str
) -> None:
    main, sub = {"OFFBOARD": (6, 0), "FOLLOW": (4, 8), "POSITION": (3, 0)}[mode]
    flight.tell(mavlink.MAVLink_command_long_message(1, 1, 176, 0, 1, main, sub, 0, 0, 0, 0))
    for _ in range(3):
        flight.tell(message_of(name, floats))
        flight.run(0.02)
    assert is_finite(flight.autopilot.topics)


@pytest.mark.parametrize("field", ["xacc", "zgyro", "ymag", "abs_pressure"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_sensors_senseless_sample_is_not_taken(field: str, value: float) -> None:
    """A simulator's HIL_SENSOR is trusted no more than anybody else."""
    flown = Flight()
    for _ in range(50):
        messages = [
            HilSensor(**{**each._asdict(), field: value}) if type(each) is HilSensor else each
            for each in flown.simulator.tick(flown.controls)
        ]
        flown.autopilot.step(messages)
    assert is_finite(flown.autopilot.topics)
    assert flown.autopilot.topics.vehicle_status.nav_state is NavState.AUTO_LOITER
