"""MAVSDK (4.x, `pip install mavsdk`) takes a vehicle off, sends it to a place and lands it.

    sitl-emu launch iris                          # in one terminal
    python examples/mavsdk_takeoff_and_goto.py    # in another

The address is that of the first vehicle's onboard link; the second vehicle's is port 14541, and so on.
"""

import asyncio
import sys

from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.exceptions import MavsdkError


async def main(url: str) -> None:
    """Fly."""
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(timeout_s=30.0)
        if system is None:
            sys.exit(f"no vehicle on {url}: is `sitl-emu launch iris` running?")
        action, telemetry = ActionAsync(system), TelemetryAsync(system)

        async for ready in telemetry.subscribe_health_all_ok():
            if ready:
                break
        print("ready")
        await action.set_takeoff_altitude(10.0)
        await action.arm()
        await action.takeoff()
        async for position in telemetry.subscribe_position():
            if position.relative_altitude_m > 9.5:
                break
        print(f"in the air, {position.relative_altitude_m:.1f} m high")

        ground_m = position.absolute_altitude_m - position.relative_altitude_m
        north, east = position.latitude_deg + 0.0003, position.longitude_deg + 0.0002
        await action.goto_location(north, east, ground_m + 15.0, 0.0)
        async for position in telemetry.subscribe_position():
            if abs(position.latitude_deg - north) < 1e-5 and abs(position.longitude_deg - east) < 1e-5:
                break
        print(f"there: {position.latitude_deg:.6f}, {position.longitude_deg:.6f}")

        await action.land()
        async for armed in telemetry.subscribe_armed():
            if not armed:
                break
        print("landed")


if __name__ == "__main__":
    try:
        asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "udpin://0.0.0.0:14540"))
    except MavsdkError as error:  # a refusal, with the name of what was refused
        sys.exit(str(error))
