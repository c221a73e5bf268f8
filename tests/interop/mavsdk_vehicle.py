"""A launched vehicle as a MAVSDK user's script sees it: wait for values of its streams, fly it up, bring it home."""

import contextlib
import math
import queue
from collections.abc import Callable, Iterator
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk, System
from mavsdk.exceptions import MavsdkError
from mavsdk.plugins.action import Action
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import FlightMode, Position, Telemetry

from tests.launched import launched

METRES_PER_DEGREE = 111_195.0
"""Of latitude, on PX4's sphere."""
IRIS_PARAMETERS = 954
"""947 as PX4's hexacopter, and those of its range finder."""
STEP_LIMIT_S = 60.0
SPEED = "4"


def place(north_m: float, east_m: float, lat_deg: float, lon_deg: float) -> tuple[float, float]:
    """Latitude and longitude some metres away."""
    return (
        lat_deg + north_m / METRES_PER_DEGREE,
        lon_deg + east_m / METRES_PER_DEGREE / math.cos(math.radians(lat_deg)),
    )


def distance_m(a: Position, b: Position) -> float:
    """Over ground."""
    north = (a.latitude_deg - b.latitude_deg) * METRES_PER_DEGREE
    east = (a.longitude_deg - b.longitude_deg) * METRES_PER_DEGREE * math.cos(math.radians(b.latitude_deg))
    return math.hypot(north, east)


def until(plugin: Any, stream: str, accept: Callable[[Any], bool] = lambda _: True) -> Any:
    """The first value of a plugin's stream that is accepted; raises TimeoutError when none comes in time."""
    values: queue.Queue[Any] = queue.Queue()
    value: Any = None
    handle = getattr(plugin, f"subscribe_{stream}")(lambda new, _user_data: values.put(new))
    try:
        while True:
            value = values.get(timeout=STEP_LIMIT_S)
            if accept(value):
                return value
    except queue.Empty:
        raise TimeoutError(f"{stream}: the last value was {value}") from None
    finally:
        getattr(plugin, f"unsubscribe_{stream}")(handle)


class Vehicle:
    """A system with the plugins that every test needs."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.action, self.telemetry, self.param = Action(system), Telemetry(system), Param(system)

    def until_ready(self) -> None:
        """Until it can be armed."""
        until(self.telemetry, "health_all_ok", bool)
        until(self.telemetry, "position", lambda position: math.isfinite(position.latitude_deg))

    def until_mode(self, mode: FlightMode) -> None:
        """Until it flies in a mode."""
        until(self.telemetry, "flight_mode", lambda now: now == mode)

    def until_disarmed(self) -> None:
        """Until it has landed and disarmed itself."""
        until(self.telemetry, "armed", lambda armed: not armed)

    def take_off(self, height_m: float = 10.0) -> Position:
        """Arm and climb; where it started from."""
        self.until_ready()
        start: Position = self.telemetry.position()
        self.action.set_takeoff_altitude(height_m)
        self.action.arm()
        self.action.takeoff()
        until(self.telemetry, "position", lambda position: position.relative_altitude_m > height_m - 1.0)
        return start

    def land(self) -> None:
        """Land where it is."""
        self.action.land()
        self.until_disarmed()

    def put_down(self) -> None:
        """On the ground and disarmed in Hold, whatever a test has left."""
        if self.telemetry.armed():
            with contextlib.suppress(MavsdkError, TimeoutError):
                self.land()
        if self.telemetry.armed():
            self.action.kill()
            self.until_disarmed()
        if self.telemetry.flight_mode() != FlightMode.HOLD:
            self.action.hold()
            self.until_mode(FlightMode.HOLD)

    @contextlib.contextmanager
    def with_param(self, name: str, value: float) -> Iterator[None]:
        """With another value of a float parameter."""
        before = self.param.get_param_float(name)
        self.param.set_param_float(name, value)
        try:
            yield
        finally:
            self.param.set_param_float(name, before)


@contextlib.contextmanager
def connected(model: str, instance: int, speed: str = SPEED, *more: str) -> Iterator[Vehicle]:
    """A launched vehicle, found by MAVSDK on its onboard link; `more`: arguments of `launch`."""
    station = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    with launched(model, "--instance", str(instance), "--speed", speed, *more) as process, Mavsdk(station) as mavsdk:
        mavsdk.add_any_connection(f"udpin://0.0.0.0:{min(14540 + instance, 14549)}")
        system = mavsdk.first_autopilot(timeout_s=30.0)
        assert system is not None
        assert process.poll() is None  # it is this one that MAVSDK found
        yield Vehicle(system)
