"""How long a multicopter hovers, and how much its motors lift: measured in the simulator, in simulated time.

    python tools/measure_vehicle.py [MODEL] [--parcel]

The whole autopilot takes off, hovers at 10 m in still air, and goes home when PX4's battery failsafe says so
(critical, by BAT_CRIT_THR and COM_LOW_BAT_ACT). Thrust over weight is that of full control held for two seconds: on a
full battery, and on one that has 10 % left, whose voltage is lower. A minute or two for half an hour of flight.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for tests.flight

from sitl_emu import vehicles
from sitl_emu.core.simulator_api import HilActuatorControls
from sitl_emu.vehicles import inertia
from sitl_emu.vehicles.description import Vehicle
from sitl_emu.world.atmosphere import gravity_m_s2
from sitl_emu.world.ground import FlatGround
from sitl_emu.world.simulator import VehicleSimulator
from tests.flight.pilot import HOME, Pilot

UP_M = 10.0
LONGEST_S = 7200.0
FULL_TICKS = 500
"""Two seconds: the rotors have long followed, and the battery sags."""
ARMED = 128
LOW = 0.1


class Hover(NamedTuple):
    """What a hover took, from arming on."""

    until_failsafe_s: float
    until_landed_s: float
    power_w: float
    """Of motors and avionics, in the first minute."""
    left: float
    """Charge when the failsafe came, 0..1."""


def hover(model: str, *, parcel: bool) -> Hover:
    """Fly until the battery's failsafe, and home. Raises AssertionError where it does not come."""
    pilot = Pilot(model, parcel=parcel)
    battery, topics = pilot.simulator.battery, pilot.topics
    pilot.take_off(UP_M)
    armed_us = topics.vehicle_status.armed_time
    pilot.run(60.0)
    power_w = battery.voltage_v * battery.current_a
    pilot.until(lambda: topics.vehicle_status.failsafe, LONGEST_S)
    failsafe_s, left = _since(pilot, armed_us), battery.remaining
    pilot.until(lambda: not topics.vehicle_status.armed, LONGEST_S)
    return Hover(failsafe_s, _since(pilot, armed_us), power_w, left)


def thrust_to_weight(vehicle: Vehicle, charge: float) -> float:
    """At full control, with so much left in the battery (0..1)."""
    assert vehicle.propulsion is not None
    simulator = VehicleSimulator(vehicle, HOME, 1, FlatGround())
    simulator.battery.remaining = charge
    full = HilActuatorControls(0, 1, (1.0,) * len(vehicle.propulsion.rotors), ARMED)
    for _ in range(FULL_TICKS):
        simulator.tick(full)
    thrust_n = vehicle.propulsion.thrust_max_n * sum(speed**2 for speed in simulator.dynamics.motor_speeds())
    return thrust_n / (inertia.laden(vehicle).mass_kg * gravity_m_s2(HOME.lat_deg))


def _since(pilot: Pilot, armed_us: int) -> float:
    return (pilot.simulator.time_usec - armed_us) * 1e-6


def main() -> None:
    """Measure, and print it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("model", nargs="?", default="responder")
    parser.add_argument("--parcel", action="store_true", help="with what its release can carry")
    given = parser.parse_args()
    vehicle = vehicles.load(given.model)
    if given.parcel:
        vehicle = vehicles.with_parcel(vehicle, {})
    print(f"{vehicle.model}: {inertia.laden(vehicle).mass_kg:.2f} kg")
    for name, charge in (("a full battery", 1.0), (f"{LOW:.0%} left", LOW)):
        print(f"  thrust over weight, {name}: {thrust_to_weight(vehicle, charge):.2f}")
    flown = hover(given.model, parcel=given.parcel)
    print(f"  hovers {flown.until_failsafe_s / 60:.1f} min until the battery's failsafe ({flown.left:.0%} left)")
    print(f"  has landed after {flown.until_landed_s / 60:.1f} min; {flown.power_w:.0f} W in the first minute")


if __name__ == "__main__":
    main()
