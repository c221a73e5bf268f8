"""A bad radio for tests of several aircraft: what is broadcast is lost, late, reordered and doubled, by its seed."""

import random
from typing import Generic, TypeVar

Content = TypeVar("Content")


class Air(Generic[Content]):
    """Loses, delays, reorders and doubles what is broadcast, by its seed."""

    def __init__(self, loss: float, seed: int) -> None:
        self._loss, self._dice = loss, random.Random(f"air {seed}")
        self._coming = list[tuple[int, int, int, int, int, Content]]()

    def send(self, now_us: int, sender: int, receivers: list[int], content: Content) -> None:
        for receiver in receivers:
            for _ in range(1 + (self._dice.random() < 0.1)):
                delay_us = self._dice.choice((20_000, 50_000, 900_000))
                if self._dice.random() >= self._loss:
                    order = self._dice.randrange(1 << 30)
                    self._coming.append((now_us + delay_us, order, receiver, sender, now_us, content))

    def due(self, now_us: int) -> list[tuple[int, int, int, Content]]:
        come = sorted(one for one in self._coming if one[0] <= now_us)
        self._coming = [one for one in self._coming if one[0] > now_us]
        return [one[2:] for one in come]
