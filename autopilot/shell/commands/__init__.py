"""The shell's commands, one file each, named as PX4's module or system command.

Listed is what does something here; a command of PX4 that is missing is as unknown as one of which PX4 does not know.
"""

from sitl_emu.autopilot.control.mc_autotune import McAutotune
from sitl_emu.autopilot.shell.command import Command
from sitl_emu.autopilot.shell.commands import (
    actuator_test,
    camera_trigger,
    commander,
    control_allocator,
    dataman,
    ekf2,
    failure,
    flight_mode_manager,
    gimbal,
    land_detector,
    listener,
    logger,
    mavlink,
    module,
    navigator,
    param,
    payload_deliverer,
    pwm_out_sim,
    sensors,
    shutdown,
    sleep,
    system_time,
    uorb,
    ver,
)
from sitl_emu.autopilot.vehicle_kind import VehicleKind

MODULES: dict[str, module.Runs] = {
    **{name: module.of_kind(name) for kind in VehicleKind for name in sorted(kind.traits.modules)},
    "battery_simulator": lambda vehicle: vehicle.sensors.battery_simulator.runs,
    "failure_injection_manager": module.always,
    "load_mon": module.always,
    "manual_control": module.always,
    "mc_autotune_attitude_control": module.was_started(McAutotune),
    "rc_update": module.always,
    "system_power_simulator": module.always,
    "tone_alarm": module.always,
}
COMMANDS: dict[str, Command] = {
    **{name: module.command(name, runs) for name, runs in MODULES.items()},
    "actuator_test": actuator_test.main,
    "camera_trigger": camera_trigger.main,
    "commander": commander.main,
    "control_allocator": control_allocator.main,
    "dataman": dataman.main,
    "ekf2": ekf2.main,
    "failure": failure.main,
    "flight_mode_manager": flight_mode_manager.main,
    "gimbal": gimbal.main,
    "land_detector": land_detector.main,
    "listener": listener.main,
    "logger": logger.main,
    "mavlink": mavlink.main,
    "navigator": navigator.main,
    "param": param.main,
    "payload_deliverer": payload_deliverer.main,
    "pwm_out_sim": pwm_out_sim.main,
    "sensors": sensors.main,
    "shutdown": shutdown.main,
    "sleep": sleep.main,
    "system_time": system_time.main,
    "uorb": uorb.main,
    "ver": ver.main,
}
