"""The channel to an autopilot from outside, which may be silent where ours answers every tick.

A real PX4 v1.18 listens for some seconds of its start-up before it speaks. From then on a multicopter answers every
HIL_SENSOR, since its rate controller runs with each; a rover speaks only when its controllers give outputs, and not at
all while it is disarmed (modules/simulation/simulator_mavlink sends when actuator_outputs is published).
"""

from collections.abc import Sequence

from sitl_emu.core.simulator_api import (
    LOCKSTEP,
    BesideMessage,
    HilActuatorControls,
    HilSensor,
    PictureTaken,
    SimulatorMessage,
)
from sitl_emu.core.tcp_channel import TcpSimulatorChannel
from sitl_emu.run.carried import Carried
from sitl_emu.vehicles import Vehicle

FIRST_ANSWER_S = 0.02
"""Wall time that a tick waits for a multicopter's autopilot that has not spoken yet, or answers an earlier one."""
KEEPING_UP_S = 0.004
"""Wall time that a tick waits for one that need not answer: as long as the tick, so that it keeps up in real time."""
OFF = HilActuatorControls(0, 0, (0.0,) * 16, 0)


class OutsideChannel:
    """The simulator's end of a channel, for an autopilot that may be silent: then its last outputs hold."""

    def __init__(self, channel: TcpSimulatorChannel, vehicle: Vehicle, carried: Carried | None = None) -> None:
        """`carried`: camera and gimbal that speak to it, stepped with each tick."""
        self._channel, self._carried = channel, carried
        self._said: Sequence[BesideMessage] = ()
        self._answers_every_tick = vehicle.propulsion is not None
        self._patience_s = FIRST_ANSWER_S if self._answers_every_tick else KEEPING_UP_S
        self._last = OFF
        self._tick_us = 0
        """HIL_SENSOR.time_usec of the last tick."""
        self._has_spoken = False

    def send(self, messages: list[SimulatorMessage]) -> None:
        """One tick's messages. Raises ChannelClosed."""
        self._channel.send(messages)
        sensor = messages[-1]
        if not isinstance(sensor, HilSensor):
            return
        self._tick_us = sensor.time_usec
        if self._carried is not None:
            pictures = [message for message in messages if isinstance(message, PictureTaken)]
            self._said = self._carried.step(sensor.time_usec, pictures)

    def receive(self) -> HilActuatorControls:
        """The answer, or the last one where none comes soon. Raises ChannelClosed.

        Who slept when its first ticks came still answers those when it has spoken: its answers are taken by their time,
        not counted, or all its flight it would be so many ticks behind. One that has made nothing new says an old time.
        """
        if self._has_spoken and self._answers_every_tick:
            answer = self._channel.receive()
            while answer.flags & LOCKSTEP and answer.time_usec < self._tick_us:
                later = self._channel.poll(FIRST_ANSWER_S)
                if later is None:
                    break
                answer = later
            return answer
        newest = self._channel.newest(self._patience_s)
        if newest is not None:
            self._last, self._has_spoken = newest, True
        return self._last

    def beside(self) -> Sequence[BesideMessage]:
        """What came beside, and what is carried has to say."""
        said, self._said = self._said, ()
        return [*self._channel.beside(), *said]
