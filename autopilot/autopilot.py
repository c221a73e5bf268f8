"""The autopilot: one tick of all its modules, in the order in which data flows.

A state machine on simulated time: `step` is handed what the simulator sent and returns the answer; datagrams come in
through `on_datagram` and lie ready in `mavlink.links[n].outbox`. No socket, clock or thread is read in here;
`sitl_emu/run/` does that.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sitl_emu.autopilot.commander.commander import Commander
from sitl_emu.autopilot.commands.outgoing_commands import OutgoingCommands
from sitl_emu.autopilot.commands.vehicle_commands import CommandOwner, CommandResult, VehicleCommands, tell
from sitl_emu.autopilot.control.control import CONTROLS, StartedModule
from sitl_emu.autopilot.estimator.commands import EstimatorCommands
from sitl_emu.autopilot.estimator.estimator import Estimator
from sitl_emu.autopilot.events.texts import Texts
from sitl_emu.autopilot.land_detector.land_detector import LandDetector
from sitl_emu.autopilot.logger.logger import Logger
from sitl_emu.autopilot.manual_control.manual_control import ManualControl
from sitl_emu.autopilot.manual_control.rc_update import RcUpdate
from sitl_emu.autopilot.mavlink.component_metadata import files
from sitl_emu.autopilot.mavlink.mavlink import Mavlink, Modules
from sitl_emu.autopilot.modes.flight_modes import FlightModes
from sitl_emu.autopilot.navigator.navigator import Navigator
from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.parameters.corrections import ParameterCorrections
from sitl_emu.autopilot.parameters.storage import ParameterStorage
from sitl_emu.autopilot.payload import camera_trigger
from sitl_emu.autopilot.payload.camera_trigger import CameraTrigger
from sitl_emu.autopilot.payload.gimbal import Gimbal
from sitl_emu.autopilot.payload.payload_deliverer import PayloadDeliverer
from sitl_emu.autopilot.sensors.baro_gnss_calibration import BaroGnssCalibration
from sitl_emu.autopilot.sensors.gyro_calibration import GyroCalibration
from sitl_emu.autopilot.sensors.in_flight_calibration import InFlightCalibration
from sitl_emu.autopilot.sensors.sensor_failover import SensorFailover
from sitl_emu.autopilot.sensors.sensors import Sensors
from sitl_emu.autopilot.sensors.vehicle_acceleration import AccelerationFilter
from sitl_emu.autopilot.sensors.vehicle_imu import VehicleImu
from sitl_emu.autopilot.shell.commands import COMMANDS
from sitl_emu.autopilot.shell.pxh import Pxh
from sitl_emu.autopilot.storage.dataman import Dataman
from sitl_emu.autopilot.system.failure_injection import FailureInjectionManager
from sitl_emu.autopilot.system.load_mon import LoadMon
from sitl_emu.autopilot.topics import Topics, VehicleCommand
from sitl_emu.autopilot.uxrce_dds_client.uxrce_dds_client import UxrceDdsClient
from sitl_emu.autopilot.vehicle_kind import VehicleKind
from sitl_emu.autopilot.vision_target_estimator.vision_target_estimator import VisionTargetEstimator
from sitl_emu.core.simulator_api import LOCKSTEP, HilActuatorControls, SimulatorMessage

if TYPE_CHECKING:
    from sitl_emu.autopilot.uxrce_dds_client.uxrce_dds_client import UxrceDdsClient

MODE_FLAG_SAFETY_ARMED: Final = 128
MODE_FLAG_TEST_ENABLED: Final = 2
SITL_DEFAULTS: Final = {"COM_CPU_MAX": -1.0, "COM_RAM_MAX": -1.0}
"""Of every airframe (init.d-posix/rcS): how busy a simulation is tells nothing of a vehicle."""
POSITION_EVERY: Final = 2
"""Position control runs on every second tick (125 Hz), as PX4's does on vehicle_local_position; before it the modes,
which take some of these (`flight_modes.INTERVAL_US`)."""
COMMANDER_EVERY: Final = 3
"""Commander and navigator run on every third tick (83 Hz): between two runs PX4's commander sleeps 10 ms
(COMMANDER_MONITORING_INTERVAL), which are three ticks, as simulated time stands between them."""
OTHERS_EVERY: Final = 5
"""What watches sensors, saves, and acts on a payload runs on every fifth tick (50 Hz, ours)."""


class Autopilot:
    """One vehicle's PX4."""

    def __init__(
        self, airframe: Mapping[str, Value], instance: int, root: Path | None = None, *, display: bool = False
    ) -> None:
        """`airframe`: PX4 parameters that differ from their defaults; MAV_TYPE says of what kind it is.

        `root`: the folder that stands for PX4's file system, as storage.prepare leaves it; None: there is no storage.
        `display`: it has a MAVLink link to what draws the vehicle, as with PX4's own simulation.
        """
        kind = VehicleKind.of_mav_type(airframe.get("MAV_TYPE", 0))
        traits = kind.traits
        self.parameters = Parameters(kind, {**SITL_DEFAULTS, **airframe, "MAV_SYS_ID": instance + 1})
        self.topics = Topics()
        self.texts = Texts()
        self.parameter_storage = ParameterStorage(self.parameters, root, self.texts.of("param"))
        self.parameter_storage.boot()
        self.parameter_corrections = ParameterCorrections(self.parameters, self.texts, traits)
        self.dataman = Dataman(root, self.texts.of("dataman"))
        shared = (self.topics, self.parameters)
        self.sensors = Sensors(*shared)
        self.vehicle_imu = VehicleImu(self.topics)
        self.vehicle_acceleration = AccelerationFilter(*shared)
        self.in_flight_calibration = InFlightCalibration(self.topics, self.parameters)
        self.gyro_calibration = GyroCalibration(self.topics, self.parameters)
        self.baro_gnss_calibration = BaroGnssCalibration(self.topics, self.parameters)
        self.mag_failover = SensorFailover("MAG", self.sensors.mag_validator, self.texts.of("vehicle_magnetometer"))
        self.baro_failover = SensorFailover("BARO", self.sensors.baro_validator, self.texts.of("vehicle_air_data"))
        self.estimator = Estimator(*shared)
        self.land_detector = LandDetector(*shared, traits)
        self.rc_update = RcUpdate(*shared)
        self.manual_control = ManualControl(*shared)
        self.outgoing = OutgoingCommands()
        self.commander = Commander(
            *shared,
            self.dataman,
            self.texts.of("commander"),
            self.texts.events.send,
            self.parameter_storage,
            self.outgoing,
            self.texts.of,
            self.texts.note,
        )
        self.navigator = Navigator(
            *shared, self.dataman, self.texts.of("navigator"), self.texts.events.send, self.outgoing
        )
        sees_targets = "vision_target_estimator" in traits.modules
        self.vision_target_estimator = VisionTargetEstimator(*shared) if sees_targets else None
        self.flight_modes = FlightModes(*shared, self.texts)
        self._runs_flight_modes = "flight_mode_manager" in traits.modules
        self.control = CONTROLS[kind](*shared, self.texts)
        self.payload_deliverer = PayloadDeliverer(*shared, self.outgoing)
        self.camera_trigger = CameraTrigger(*shared, self.outgoing) if camera_trigger.starts(self.parameters) else None
        self.started = self._started_modules()
        self.commands = VehicleCommands(self._owners(), self.texts.note)
        self.logger = Logger(
            *shared, self.texts, root, lambda: self.mavlink.context.boot_unix_us, files.event_definitions
        )
        modules = Modules(
            self._on_command,
            self.navigator.set_current_mission_item,
            self.navigator.mission_changed,
            lambda: Pxh(COMMANDS, self),
            self.logger,
        )
        self.mavlink = Mavlink(
            *shared, self.dataman, self.texts, modules, instance, root, self.outgoing, display=display
        )
        self.load_mon = LoadMon(self.topics)
        self.uxrce_dds_client: UxrceDdsClient | None = None
        """None: it was not started."""
        self.now_us = 0
        self._ticks = 0

    def step(self, messages: list[SimulatorMessage]) -> HilActuatorControls:
        """One tick: from sensors to actuators. `messages` ends with the HIL_SENSOR that gives the time."""
        now_us = self.now_us = self.sensors.update(messages)
        ticks = self._ticks = self._ticks + 1
        self.vehicle_imu.update(now_us)
        self.vehicle_acceleration.update(now_us)
        self.estimator.update(now_us)
        if self.commander.calibration.busy:
            self.commander.calibration.update(now_us)
        if ticks % OTHERS_EVERY == 0:
            self.parameter_corrections.update(now_us)
            self.in_flight_calibration.update(now_us)
            self.gyro_calibration.update(now_us)
            self.baro_gnss_calibration.update()
            self.mag_failover.update(now_us)
            self.baro_failover.update(now_us)
        if ticks % COMMANDER_EVERY == 0:
            self.land_detector.update(now_us)
            self.rc_update.update()
            self.manual_control.update(now_us)
            self.commander.update(now_us)
            self.navigator.update(now_us)
        if ticks % OTHERS_EVERY == 0:
            if self.vision_target_estimator is not None:
                self.vision_target_estimator.update(now_us)
            self.payload_deliverer.update(now_us)
            for module in self.started:
                module.update(now_us)
            self.dataman.save_progress()
            self.parameter_storage.update(now_us)
        if self.camera_trigger is not None:
            self.camera_trigger.update(now_us)
        if ticks % POSITION_EVERY == 0:
            if self._runs_flight_modes:
                self.flight_modes.update(now_us)
            self.control.update_position(now_us)
        self.control.update_rate(now_us)
        self.logger.update(now_us)
        self.estimator.records.logged = self.logger.is_logging
        self.mavlink.update(now_us)
        if self.uxrce_dds_client is not None:
            self.uxrce_dds_client.update(now_us)
        outputs = self.topics.actuator_outputs
        mode = MODE_FLAG_SAFETY_ARMED if self.topics.actuator_armed.armed else 0
        if outputs.test_mode:
            mode |= MODE_FLAG_TEST_ENABLED
        return HilActuatorControls(outputs.timestamp, LOCKSTEP, outputs.controls, mode)

    def _owners(self) -> tuple[CommandOwner, ...]:
        """Who decides on commands; a later one takes precedence."""
        failures = FailureInjectionManager(self.topics, self.parameters)
        estimator = EstimatorCommands(self.estimator, self.topics, self.parameters)
        triggers = () if self.camera_trigger is None else (self.camera_trigger,)
        return (self.commander, self.navigator, self.payload_deliverer, failures, estimator, *triggers, *self.started)

    def _started_modules(self) -> tuple[StartedModule, ...]:
        """Those that PX4's start-up script starts for this airframe (rcS)."""
        modules: list[StartedModule] = [*self.control.started]
        if self.parameters["MNT_MODE_IN"] >= 0:
            modules.append(Gimbal(self.topics, self.parameters, self.outgoing))
        return tuple(modules)

    def _on_command(self, now_us: int, command: VehicleCommand) -> CommandResult | None:
        """Let its owner decide on a command that came in."""
        tell(self.topics, now_us, command)
        return self.commands.handle(now_us, command)

    def on_datagram(self, link: int, data: bytes) -> None:
        """A datagram came in on a link (index in `mavlink.links`)."""
        self.mavlink.on_datagram(self.now_us, link, data)

    def start_uxrce_dds_client(self) -> "UxrceDdsClient":
        """Speak to ROS 2 from now on; the date of time 0 has to be known."""
        # who never does starts the faster without it
        from sitl_emu.autopilot.uxrce_dds_client.uxrce_dds_client import UxrceDdsClient

        boot_unix_us, system_id = self.mavlink.context.boot_unix_us, self.mavlink.system_id
        self.uxrce_dds_client = UxrceDdsClient(
            self.topics, self.logger.topics(), system_id, boot_unix_us, self._on_command
        )
        return self.uxrce_dds_client

    def close(self) -> None:
        """Save what waits to be saved; nothing else may be called afterwards."""
        self.logger.shut_down()
        self.parameter_storage.close()
