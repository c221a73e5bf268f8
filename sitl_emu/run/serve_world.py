"""`sitl-emu world`: the simulator alone, serving TCP 4560+i to whatever autopilot connects, a real PX4 for one.

All vehicles stand in one world and go in step: a tick is done when every autopilot has answered (or need not:
`outside_channel.py`). It starts when all have connected, and stays until Ctrl-C or
until an autopilot leaves. A vehicle whose autopilot was shut down stays in it, with its motors off, until all were.
"""

import math
import signal
import time
from collections.abc import Callable, Sequence
from types import FrameType

from sitl_emu import vehicles
from sitl_emu.core import ports
from sitl_emu.core.simulator_api import (
    STATE_BOOT,
    STATE_POWEROFF,
    CameraTrigger,
    CameraZoom,
    ChannelClosed,
    GimbalState,
    HilActuatorControls,
    SimulatorParameter,
    VideoState,
)
from sitl_emu.core.tcp_channel import SimulatorListener
from sitl_emu.run import site
from sitl_emu.run.memory import settle
from sitl_emu.run.outside_channel import OutsideChannel
from sitl_emu.run.pacing import Pacer
from sitl_emu.run.trouble import Trouble
from sitl_emu.world.contacts import told
from sitl_emu.world.simulation import Simulation


def serve_world(
    name: str,
    models: Sequence[str],
    instance: int,
    seed: int,
    speed: float | None,
    say: Callable[[str], None],
    *,
    parcels: bool = False,
) -> int:
    """Serve until Ctrl-C; the exit status. Raises Trouble for what is unknown and for a port in use.

    `parcels`: whether vehicles that have a release carry one.
    """
    here = site.in_world(name, seed, say, parcels=parcels)
    try:
        described = [vehicles.load(model) for model in models]
        if parcels:
            described = vehicles.with_parcels(described)
        listeners = [SimulatorListener(ports.simulator(instance + place)) for place in range(len(models))]
    except vehicles.VehicleError as error:
        raise Trouble(str(error)) from None
    except OSError as error:
        raise Trouble(error.strerror or str(error)) from None

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)
    try:
        row = enumerate(zip(described, here.row(described), strict=True))
        simulators = [here.simulator(each, offset_m, f"vehicle{place}") for place, (each, offset_m) in row]
        simulation = Simulation(simulators, here.solids, here.areas)
        if held := simulation.begins_in(models):
            raise Trouble(f"{held}; {site.NO_ROOM}")
        for place, model in enumerate(models):
            say(f"{model}: waiting for its autopilot on TCP {ports.simulator(instance + place)}")
        channels = [OutsideChannel(each.accept(), vehicle) for each, vehicle in zip(listeners, described, strict=True)]
        say("all autopilots are connected")
        settle()
        _serve(simulation, channels, math.inf if speed is None else speed, models, say)
        say("all autopilots were shut down; the world ends")
        return 0
    except ChannelClosed as error:
        say(f"{error}; the world ends")
        return 1
    except KeyboardInterrupt:
        return 0


def _serve(
    simulation: Simulation,
    channels: Sequence[OutsideChannel],
    speed: float,
    models: Sequence[str],
    say: Callable[[str], None],
) -> None:
    """Tick until all autopilots were shut down. Raises ChannelClosed when one leaves without a word."""
    pacer = Pacer(speed)
    controls: list[HilActuatorControls | None] = [None] * len(channels)
    on = dict(enumerate(channels))
    while on:
        sensed = simulation.tick(controls)
        for impact in simulation.impacts():
            say(told(impact, models))
        for news in simulation.parcels_told():
            say(f"{models[news.place]}: {news.what}: {news.text}")
        for place, channel in on.items():
            channel.send(sensed[place])
        for place, channel in list(on.items()):
            controls[place] = channel.receive()
            for message in channel.beside():
                if isinstance(message, SimulatorParameter):
                    simulation.set_parameter(place, *message)
                elif isinstance(message, GimbalState | CameraZoom | CameraTrigger | VideoState):
                    pass  # nobody draws what is seen
                elif message.system_status == STATE_BOOT:
                    say(f"{models[place]}: its autopilot was rebooted")
                elif message.system_status == STATE_POWEROFF:
                    say(f"{models[place]}: its autopilot was shut down")
                    del on[place]
        pacer.next_tick()
        if (left := pacer.remaining_s()) > 0.0:
            time.sleep(left)
