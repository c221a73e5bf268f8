"""A script as users of MAVSDK 3 (gRPC) have it: connect, wait, arm, take off, a mission, offboard, land.

python mavsdk3_script.py udpin://0.0.0.0:14540 50051
"""

import asyncio
import sys

from mavsdk import System
from mavsdk.info import InfoError, Version
from mavsdk.mission import MissionItem, MissionPlan
from mavsdk.offboard import OffboardError, PositionNedYaw

NAN = float("nan")


def item(lat_deg: float, lon_deg: float) -> MissionItem:
    camera, vehicle = MissionItem.CameraAction.NONE, MissionItem.VehicleAction.NONE
    return MissionItem(lat_deg, lon_deg, 12, 5, True, NAN, NAN, camera, NAN, NAN, NAN, NAN, NAN, vehicle)


async def version_of(drone: System) -> Version:
    """MAVSDK asks for it by itself once connected, and until the answer is there says that it is not."""
    while True:
        try:
            return await drone.info.get_version()
        except InfoError:
            await asyncio.sleep(0.1)


async def main(address: str, port: int) -> None:
    drone = System(port=port)
    await drone.connect(system_address=address)
    async for state in drone.core.connection_state():
        if state.is_connected:
            break
    print("connected", flush=True)
    version = await version_of(drone)
    print("version", version.flight_sw_major, version.flight_sw_minor, flush=True)
    async for health in drone.telemetry.health():
        if health.is_global_position_ok and health.is_home_position_ok and health.is_armable:
            break
    position = await anext(drone.telemetry.position())
    print("cruise", await drone.param.get_param_float("MPC_XY_CRUISE"), flush=True)
    print("parameters", len((await drone.param.get_all_params()).float_params) > 500, flush=True)

    await drone.param.set_param_float("COM_OF_LOSS_T", 10.0)  # its time runs faster than that of a busy machine
    corners = [(position.latitude_deg + 2e-4, position.longitude_deg), (position.latitude_deg, position.longitude_deg)]
    await drone.mission.upload_mission(MissionPlan([item(*corner) for corner in corners]))
    await drone.action.set_takeoff_altitude(10)
    await drone.action.arm()
    await drone.action.takeoff()
    async for now in drone.telemetry.position():
        if now.relative_altitude_m > 9:
            break
    print("in the air", flush=True)

    await drone.mission.start_mission()
    async for progress in drone.mission.mission_progress():
        if progress.current == progress.total:
            break
    print("mission", len((await drone.mission.download_mission()).mission_items), flush=True)

    try:
        await drone.offboard.start()
    except OffboardError as error:
        print("offboard", error._result.result.name, flush=True)
    await drone.offboard.set_position_ned(PositionNedYaw(5.0, 0.0, -8.0, 0.0))
    await drone.offboard.start()
    async for there in drone.telemetry.position_velocity_ned():
        if abs(there.position.north_m - 5.0) < 0.8 and abs(there.position.down_m + 8.0) < 0.8:
            break
    await drone.offboard.stop()
    print("offboard flown", flush=True)

    await drone.action.land()
    async for armed in drone.telemetry.armed():
        if not armed:
            break
    print("landed", flush=True)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2])))
