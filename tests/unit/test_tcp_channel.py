import math
import socket
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_emu import vehicles
from sitl_emu.autopilot.autopilot import Autopilot
from sitl_emu.core import dialect as mavlink
from sitl_emu.core.simulator_api import (
    SIMULATOR_PARAMETERS,
    STATE_BOOT,
    AutopilotChannel,
    AutopilotState,
    BesideMessage,
    CameraTrigger,
    CameraZoom,
    ChannelClosed,
    DistanceSensor,
    GimbalState,
    HilActuatorControls,
    HilGps,
    HilSensor,
    HilStateQuaternion,
    MemoryChannel,
    PictureTaken,
    SimulatedBattery,
    SimulatorChannel,
    SimulatorParameter,
    VideoState,
    actuators_as_on_the_wire,
    as_on_the_wire,
)
from sitl_emu.core.tcp_channel import (
    CODECS,
    Framer,
    Record,
    SimulatorListener,
    TcpAutopilotChannel,
    TcpSimulatorChannel,
    connect,
)
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, Pose, VehicleSimulator
from tests.typed import now

HOME = Home(40.47, -86.99, 215.0, 30.0)
ARM_TICK, AIRBORNE_TICK = 2500, 3750


def unsigned(bits: int) -> st.SearchStrategy[int]:
    return st.integers(0, 2**bits - 1)


def signed(bits: int) -> st.SearchStrategy[int]:
    return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


f32 = st.floats(width=32, allow_nan=False)
quaternions = st.tuples(f32, f32, f32, f32)
records = st.one_of(
    st.builds(HilSensor, unsigned(64), *[f32] * 13, unsigned(32), unsigned(8)),
    st.builds(
        HilGps, unsigned(64), *[signed(32)] * 3, *[unsigned(16)] * 3, *[signed(16)] * 3, unsigned(16),
        *[unsigned(8)] * 3, unsigned(16),
    ),
    st.builds(
        DistanceSensor, unsigned(32), *[unsigned(16)] * 3, *[unsigned(8)] * 4, f32, f32, quaternions, unsigned(8)
    ),
    st.builds(
        HilStateQuaternion, unsigned(64), quaternions, f32, f32, f32, *[signed(32)] * 3, *[signed(16)] * 3,
        unsigned(16), unsigned(16), *[signed(16)] * 3,
    ),
    st.builds(SimulatedBattery, f32, f32, f32),
    st.builds(
        HilActuatorControls, unsigned(64), unsigned(64), st.lists(f32, max_size=16).map(tuple), unsigned(8)
    ),
    st.builds(SimulatorParameter, st.sampled_from(SIMULATOR_PARAMETERS), f32),
    st.builds(AutopilotState, unsigned(8)),
    st.builds(GimbalState, quaternions),
    st.builds(CameraZoom, f32),
    st.builds(CameraTrigger, unsigned(32)),
    st.builds(VideoState, st.booleans()),
    st.builds(PictureTaken, unsigned(31), st.booleans()),
)  # fmt: skip


def wire(record: Record) -> Record:
    if isinstance(record, HilActuatorControls):
        return actuators_as_on_the_wire(record)
    if isinstance(record, SimulatorParameter | AutopilotState | GimbalState | CameraZoom | CameraTrigger | VideoState):
        return record
    return as_on_the_wire(record)


@given(st.lists(records, max_size=5), st.integers(1, 300))
@settings(max_examples=150)
def test_round_trip_in_pieces_of_any_size(messages: list[Record], piece: int) -> None:
    sender, receiver = Framer(1, 200), Framer(1, 1)
    stream = b"".join(sender.encode(message) for message in messages)
    received = [record for at in range(0, len(stream), piece) for record in receiver.decode(stream[at : at + piece])]
    assert received == [wire(message) for message in messages]


@given(records)
@settings(max_examples=60)
def test_pymavlink_reads_and_writes_the_same_bytes(record: Record) -> None:
    frame = Framer(1, 200).encode(record)
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=200)
    parsed = link.parse_buffer(bytearray(frame))
    assert parsed is not None
    (message,) = parsed
    assert message.get_msgId() == CODECS[type(record)].message_id
    assert bytes(message.pack(link)) == frame


def test_foreign_messages_and_noise_are_skipped() -> None:
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    heartbeat = link.heartbeat_encode(2, 12, 0, 0, 0).pack(link)
    interval = link.command_long_encode(1, 1, 511, 0, 107, 4000, 0, 0, 0, 0, 0).pack(link)
    controls = HilActuatorControls(5, 1, (0.5,), 128)
    frame = Framer(1, 1).encode(controls)
    broken = bytearray(frame)
    broken[20] ^= 1
    receiver = Framer(1, 200, [HilActuatorControls])
    got = receiver.decode(b"\x00\xfe" + heartbeat + interval + bytes(broken) + frame)
    assert got == [actuators_as_on_the_wire(controls)]


def pair() -> tuple[TcpSimulatorChannel, TcpAutopilotChannel]:
    listener = socket.create_server(("127.0.0.1", 0))
    autopilot = connect(listener.getsockname()[1])
    connection, _ = listener.accept()
    listener.close()
    return TcpSimulatorChannel(connection, 4560), autopilot


@pytest.mark.parametrize("model", ["m600", "rover"])
def test_memory_and_tcp_carry_identical_records(model: str) -> None:
    def fly(simulator_end: SimulatorChannel, autopilot_end: AutopilotChannel) -> list[Record]:
        simulator = VehicleSimulator(vehicles.load(model), HOME, 5, FlatGround(), name="one")
        answer: HilActuatorControls | None = None
        log: list[Record] = []
        for tick in range(500):
            simulator_end.send(simulator.tick(answer))
            messages = autopilot_end.receive()
            log += messages
            # what is answered depends on what came, so that a difference would grow
            sensor = messages[-1]
            assert isinstance(sensor, HilSensor)
            level = 0.6 + 0.01 * sensor.xacc
            autopilot_end.send(HilActuatorControls(sensor.time_usec, 1, (level, tick / 1000.0) * 3, 128))
            answer = simulator_end.receive()
            log.append(answer)
        return log

    memory = MemoryChannel()
    ends = pair()
    try:
        assert fly(memory.simulator, memory.autopilot) == fly(*ends)
    finally:
        for end in ends:
            end.close()


def test_the_autopilot_flies_identically_over_memory_and_tcp() -> None:
    def fly(simulator_end: SimulatorChannel, autopilot_end: AutopilotChannel) -> tuple[list[HilActuatorControls], Pose]:
        vehicle = vehicles.load("iris")
        autopilot = Autopilot(vehicle.airframe, 0)
        simulator = VehicleSimulator(vehicle, HOME, 5, FlatGround(), name="one")
        ground = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        takeoff = ground.command_long_encode(1, 1, mavlink.MAV_CMD_NAV_TAKEOFF, 0, *[math.nan] * 7)
        arm = ground.command_long_encode(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
        said = {ARM_TICK: takeoff.pack(ground) + arm.pack(ground)}
        answer: HilActuatorControls | None = None
        log: list[HilActuatorControls] = []
        for tick in range(AIRBORNE_TICK):
            simulator_end.send(simulator.tick(answer))
            if tick in said:
                autopilot.on_datagram(0, said[tick])
            autopilot_end.send(autopilot.step(autopilot_end.receive()))
            for link in autopilot.mavlink.links:
                link.outbox.clear()
            answer = simulator_end.receive()
            log.append(answer)
        return log, simulator.pose()

    memory = MemoryChannel()
    ends = pair()
    try:
        log, pose = fly(memory.simulator, memory.autopilot)
        assert pose.down_m < -0.5 and log[-1].controls[0] > 0.1, "it should be in the air"
        assert (log, pose) == fly(*ends)
    finally:
        for end in ends:
            end.close()


def test_autopilot_gets_one_tick_at_a_time() -> None:
    simulator_end, autopilot_end = pair()
    try:
        simulator = VehicleSimulator(vehicles.load("iris"), HOME, 5, FlatGround())
        first, second = simulator.tick(None), simulator.tick(None)
        simulator_end.send(first + second)
        assert autopilot_end.receive() == [as_on_the_wire(message) for message in first]
        assert now(autopilot_end.ready)
        assert autopilot_end.receive() == [as_on_the_wire(message) for message in second]
        assert not autopilot_end.ready
        assert simulator_end.poll(0.01) is None
    finally:
        simulator_end.close()
        autopilot_end.close()


def test_a_closed_peer_is_named() -> None:
    simulator_end, autopilot_end = pair()
    simulator_end.close()
    with pytest.raises(ChannelClosed, match="simulator on TCP port"):
        autopilot_end.receive()
    autopilot_end.close()
    simulator_end, autopilot_end = pair()
    autopilot_end.close()
    with pytest.raises(ChannelClosed, match="autopilot on TCP port 4560"):
        simulator_end.receive()
    simulator_end.close()


def test_what_is_no_hosts_name_is_no_simulator() -> None:
    with pytest.raises(ChannelClosed, match=r"no simulator answers on 192\.168\.1\.\.20, TCP port 4560 \(this is no h"):
        connect(4560, "192.168.1..20")


def test_port_in_use_names_the_port() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=f"TCP port {port} is in use"):
            SimulatorListener(port)


def test_listener_accepts_one_and_gives_up_in_time() -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    listener = SimulatorListener(port)
    with pytest.raises(ChannelClosed, match=f"no autopilot has connected to TCP port {port}"):
        listener.accept(0.01)
    with pytest.raises(ChannelClosed, match=f"no simulator answers on 127.0.0.1, TCP port {port}"):
        connect(port)
    listener = SimulatorListener(port)
    autopilots = []
    thread = threading.Thread(target=lambda: autopilots.append(connect(port)))
    thread.start()
    simulator_end = listener.accept(5.0)
    thread.join()
    autopilots[0].send(HilActuatorControls(4000, 1, (0.25,), 0))
    assert simulator_end.receive().controls[0] == 0.25
    simulator_end.close()
    autopilots[0].close()


def test_an_autopilot_that_hangs_counts_as_gone() -> None:
    listener = SimulatorListener(0)
    port = listener._socket.getsockname()[1]
    autopilot = connect(port)
    simulator = listener.accept(5.0)
    simulator.limit_answers(0.05)
    with pytest.raises(ChannelClosed, match=r"has not answered for 0\.05 s"):
        simulator.receive()
    autopilot.close()
    simulator.close()


@pytest.mark.parametrize("over_tcp", [False, True])
def test_what_an_autopilot_says_beside_its_answer_is_there_with_the_answer(over_tcp: bool) -> None:
    ends = pair() if over_tcp else None
    memory = MemoryChannel()
    simulator, autopilot = ends if ends is not None else (memory.simulator, memory.autopilot)
    said: list[BesideMessage] = [
        SimulatorParameter("SIH_WIND_N", 2.5),
        SimulatorParameter("SIM_GPS_USED", 3.0),
        AutopilotState(STATE_BOOT),
        GimbalState((0.5, 0.5, -0.5, 0.5)),
        CameraZoom(37.5),
        CameraTrigger(7),
        VideoState(True),
        VideoState(False),
    ]
    sensor = HilSensor._make((4000, *[0.0] * 13, 0, 0))
    simulator.send([sensor])
    autopilot.receive()
    autopilot.send(HilActuatorControls(4000, 1, (0.0,), 0), said)
    simulator.receive()
    assert list(simulator.beside()) == said
    assert not simulator.beside()
    for end in ends or ():
        end.close()


@pytest.mark.parametrize("said", [GimbalState((0.1, 0.2, 0.3, 0.9)), CameraZoom(33.3)])
def test_memory_rounds_gimbal_and_zoom_as_the_wire_does(said: BesideMessage) -> None:
    ends, memory, heard = pair(), MemoryChannel(), list[BesideMessage]()
    for simulator, autopilot in (ends, (memory.simulator, memory.autopilot)):
        simulator.send([HilSensor._make((4000, *[0.0] * 13, 0, 0))])
        autopilot.receive()
        autopilot.send(HilActuatorControls(4000, 1, (0.0,), 0), [said])
        simulator.receive()
        heard += simulator.beside()
    assert heard[0] == heard[1] != said
    for end in ends:
        end.close()


def test_an_autopilot_hears_nothing_of_a_simulators_heartbeats() -> None:
    """Gazebo and jMAVSim send them."""
    listener = socket.create_server(("127.0.0.1", 0))
    autopilot = connect(listener.getsockname()[1])
    connection, _ = listener.accept()
    listener.close()
    link, sensor = mavlink.MAVLink(None, srcSystem=1, srcComponent=1), HilSensor._make((4000, *[0.0] * 13, 0, 0))
    connection.sendall(link.heartbeat_encode(2, 12, 0, 0, 0).pack(link) + Framer(1, 1).encode(sensor))
    assert autopilot.receive() == [sensor]
    autopilot.close()
    connection.close()
