"""`sitl-emu world`: the simulator alone, serving TCP 4560+i to whatever autopilot connects, a real PX4 for one.

All vehicles stand in one world and go in step: a tick is done when every autopilot has answered (from its first answer
on: a real PX4 listens for a while before it speaks). It starts when all have connected, and stays until Ctrl-C or
until an autopilot leaves.
"""

import math
import signal
import time
from collections.abc import Callable, Sequence
from types import FrameType

import vehicles
from autopilot.process import Pacer
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import ChannelClosed, HilActuatorControls, SimulatorParameter
from sitl_emu.core.tcp_channel import SimulatorListener, TcpSimulatorChannel
from sitl_emu.run import worlds
from sitl_emu.run.process import settle
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.simulation import Simulation
from sitl_emu.world.simulator import VehicleSimulator

FIRST_ANSWER_S = 0.02
"""Wall time that a tick waits for an autopilot that has not answered yet: PX4's outputs start a while after it."""
SPACING_M = 3.0
"""Vehicles stand side by side, eastwards from the world's home."""


def serve_world(
    name: str, models: Sequence[str], instance: int, seed: int, speed: float | None, say: Callable[[str], None]
) -> int:
    """Serve until Ctrl-C; the exit status. Raises Trouble for what is unknown and for a port in use."""
    world = worlds.build(name, seed, {})
    try:
        described = [vehicles.load(model) for model in models]
        listeners = [SimulatorListener(ports.simulator(instance + place)) for place in range(len(models))]
    except vehicles.VehicleError as error:
        raise Trouble(str(error)) from None
    except OSError as error:
        raise Trouble(error.strerror or str(error)) from None

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    try:
        home, simulators = world.places["home"], list[VehicleSimulator]()
        for place, vehicle in enumerate(described):
            at = (home.north_m, home.east_m + place * SPACING_M)
            origin = world.home._replace(heading_deg=home.heading_deg)
            simulators.append(
                VehicleSimulator(vehicle, origin, seed, world.terrain, world.wind, *at, f"vehicle{place}")
            )
            say(f"{models[place]}: waiting for its autopilot on TCP {ports.simulator(instance + place)}")
        channels = [listener.accept() for listener in listeners]
        say("all autopilots are connected")
        settle()
        simulation = Simulation(simulators)
        pacer = Pacer(math.inf if speed is None else speed)
        controls: list[HilActuatorControls | None] = [None] * len(channels)
        while True:
            for channel, messages in zip(channels, simulation.tick(controls), strict=True):
                channel.send(messages)
            for place, channel in enumerate(channels):
                controls[place] = channel.receive() if controls[place] else _first_answer(channel)
                for message in channel.beside():
                    if isinstance(message, SimulatorParameter):
                        simulation.set_parameter(place, *message)
            pacer.next_tick()
            if (left := pacer.remaining_s()) > 0.0:
                time.sleep(left)
    except ChannelClosed as error:
        say(f"{error}; the world ends")
        return 1
    except KeyboardInterrupt:
        return 0


def _first_answer(channel: TcpSimulatorChannel) -> HilActuatorControls | None:
    """The last answer of those that have come by now, so that none is one tick behind from then on."""
    answer = channel.poll(FIRST_ANSWER_S)
    while answer is not None and (later := channel.poll(0.0)) is not None:
        answer = later
    return answer
