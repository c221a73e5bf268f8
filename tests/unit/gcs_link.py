"""A ground station's services, face to face with our own autopilot on simulated time."""

from collections.abc import Callable
from typing import Any

from .mavlink_peer import Peer

STEP_S = 0.02


def converse(
    peer: Peer,
    service: Any,
    seconds: float,
    until: Callable[[], bool] = lambda: False,
    lost: frozenset[str] = frozenset(),
) -> list[Any]:
    """Let a service talk to the autopilot of `peer`; what it heard. Messages named in `lost` do not come, once each."""
    heard: list[Any] = []
    still_lost = set(lost)
    for _ in range(round(seconds / STEP_S)):
        to_send = service.on_time(peer.now_us)
        while to_send:
            answers = [answer for message in to_send for answer in peer.send(message)]
            to_send = hear(peer, service, answers, still_lost, heard)
        to_send = hear(peer, service, peer.run(STEP_S), still_lost, heard)
        for message in to_send:
            hear(peer, service, peer.send(message), still_lost, heard)
        if until():
            break
    return heard


def hear(peer: Peer, service: Any, messages: list[Any], lost: set[str], heard: list[Any]) -> list[Any]:
    """Hand messages to the service but those that are lost; what it answers."""
    answers = []
    for message in messages:
        name = message.get_type()
        if name in lost:
            lost.discard(name)
            continue
        heard.append(message)
        answers += service.on_message(peer.now_us, message)
    return answers
