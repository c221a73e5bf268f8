"""Plugs into an autopilot what its vehicle carries that speaks MAVLink by itself, as its data list it."""

from autopilot.autopilot import Autopilot
from sitl_emu.core import dialect as mavlink
from sitl_emu.payload.camera import Camera
from sitl_emu.payload.gimbal import Gimbal
from vehicles.description import Vehicle


def plug_in(vehicle: Vehicle, autopilot: Autopilot) -> None:
    """Camera and gimbal, where there are any."""
    system_id = autopilot.mavlink.system_id
    if vehicle.gimbal is not None:
        autopilot.mavlink.plug_in("gimbal device", "gimbal", Gimbal(vehicle.gimbal, system_id))
    if vehicle.camera is not None:
        carried_by = mavlink.MAV_COMP_ID_GIMBAL if vehicle.gimbal is not None else 0
        autopilot.mavlink.plug_in("camera", "wire", Camera(vehicle.camera, system_id, carried_by))
