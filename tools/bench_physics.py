"""CPU time of one simulated tick (4 ms) per vehicle: physics, sensors, and the way over the memory channel.

python tools/bench_physics.py [MODEL ...]
"""

import sys
import time

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import HilActuatorControls, MemoryChannel
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import Home, VehicleSimulator

TICKS = 5000


def main() -> None:
    """Print µs per tick: dynamics alone, simulator, simulator with channel."""
    home = Home(47.397742, 8.545594, 489.4, 0.0)
    print(f"{'model':24}{'dynamics':>10}{'simulator':>11}{'+ channel':>11}   µs per tick of 4 ms")
    for model in sys.argv[1:] or vehicles.models():
        vehicle = vehicles.load(model)
        flying = vehicle.propulsion is not None
        outputs = (0.75,) * len(vehicle.propulsion.rotors) if vehicle.propulsion else (0.2, 0.5)
        controls = HilActuatorControls(0, 1, outputs, 128)
        simulator = VehicleSimulator(vehicle, home, 1, FlatGround(), start_north_m=0.0 if flying else 5.0)
        channel = MemoryChannel()
        for _ in range(1000):
            simulator.tick(controls)
        step, tick = simulator.dynamics.step, simulator.tick
        start = time.process_time()
        for _ in range(TICKS):
            step(outputs, 0.0, 0.0, 0.0)
        dynamics = time.process_time()
        for _ in range(TICKS):
            tick(controls)
        ticks = time.process_time()
        for _ in range(TICKS):
            channel.simulator.send(tick(controls))
            channel.autopilot.receive()
        end = time.process_time()
        figures = [(b - a) / TICKS * 1e6 for a, b in ((start, dynamics), (dynamics, ticks), (ticks, end))]
        print(f"{model:24}{figures[0]:10.1f}{figures[1]:11.1f}{figures[2]:11.1f}")


if __name__ == "__main__":
    main()
