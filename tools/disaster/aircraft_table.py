"""What the paper's Tables 1 and 4 say of its aircraft, beside ours."""

from sitl_emu import vehicles
from sitl_emu.vehicles import inertia
from tools import measure_vehicle

AIRCRAFT = "responder"


def measured() -> str:
    """How long the aircraft flies, and how much it lifts. Markdown."""
    lines = ["### Tables 1 and 4: the aircraft", "", "| | mass | hovers | thrust over weight | paper |"]
    lines.append("| --- | --- | --- | --- | --- |")
    for what, paper, parcel in (("without a parcel", "25 min", False), ("with 2 kg", "2 kg", True)):
        print(f"Endurance {what}: hovers until the battery's failsafe; a minute or two")
        vehicle = vehicles.load(AIRCRAFT)
        if parcel:
            vehicle = vehicles.with_parcel(vehicle, {})
        flown = measure_vehicle.hover(AIRCRAFT, parcel=parcel)
        lifts = measure_vehicle.thrust_to_weight(vehicle, 1.0)
        figures = f"{inertia.laden(vehicle).mass_kg:.1f} kg | {flown.until_failsafe_s / 60.0:.1f} min | {lifts:.2f}"
        lines.append(f"| {what} | {figures} | {paper} |")
    return "\n".join(lines) + "\n"
