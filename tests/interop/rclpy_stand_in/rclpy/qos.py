"""What of rclpy.qos the example uses."""

from dataclasses import dataclass
from enum import Enum

from cyclonedds.core import Qos
from cyclonedds.qos import Policy
from cyclonedds.util import duration


class ReliabilityPolicy(Enum):
    """As ROS names them."""

    BEST_EFFORT = Policy.Reliability.BestEffort
    RELIABLE = Policy.Reliability.Reliable(duration(infinite=True))


class DurabilityPolicy(Enum):
    """As ROS names them."""

    TRANSIENT_LOCAL = Policy.Durability.TransientLocal
    VOLATILE = Policy.Durability.Volatile


class HistoryPolicy(Enum):
    """As ROS names them."""

    KEEP_LAST = Policy.History.KeepLast


@dataclass(frozen=True)
class QoSProfile:
    """As in rclpy."""

    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    history: HistoryPolicy
    depth: int

    def dds(self) -> Qos:
        """As rmw asks DDS for it."""
        plain_cdr = Policy.DataRepresentation(use_cdrv0_representation=True)
        return Qos(self.reliability.value, self.durability.value, Policy.History.KeepLast(self.depth), plain_cdr)


qos_profile_sensor_data = QoSProfile(
    ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy.VOLATILE, HistoryPolicy.KEEP_LAST, depth=5
)


def profile(told: QoSProfile | int) -> QoSProfile:
    """A number is a depth: reliable, volatile."""
    if isinstance(told, QoSProfile):
        return told
    return QoSProfile(ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE, HistoryPolicy.KEEP_LAST, told)
