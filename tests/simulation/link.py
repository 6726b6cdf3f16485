"""Simulated connections: bytes arrive in order and late, or not at all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from tests.simulation.node import Node


@dataclass(frozen=True, slots=True)
class LinkQuality:
    """Delay of one direction of a connection."""

    delay_us: int = 300
    jitter_us: int = 200
    bytes_per_s: float = float("inf")


GOOD_LINK = LinkQuality()


class Link:
    """One direction of a TCP connection to a process.

    While it is cut, messages wait, as TCP repeats them; `reset` loses those that have not arrived.
    """

    def __init__(self, receiver: Node, random: Random, quality: LinkQuality = GOOD_LINK) -> None:
        self.receiver = receiver
        self.quality = quality
        self.is_cut = False
        self._random = random
        self._held: list[tuple[Callable[[], object], int]] = []
        self._generation = 0
        self._sent_until_us = 0
        self._last_arrival_us = 0

    def send(self, deliver: Callable[[], object], size: int = 0) -> None:
        """Call `deliver` in the receiving process when the message arrives."""
        if self.is_cut:
            self._held.append((deliver, size))
            return
        loop, quality = self.receiver.loop, self.quality
        self._sent_until_us = max(self._sent_until_us, loop.now_us) + int(size * 1e6 / quality.bytes_per_s)
        arrival = self._sent_until_us + quality.delay_us + self._random.randrange(quality.jitter_us + 1)
        self._last_arrival_us = max(self._last_arrival_us + 1, arrival)
        self.receiver.call_later(self._last_arrival_us - loop.now_us, self._arrive, self._generation, deliver)

    def heal(self) -> None:
        """Deliver what waited, in order."""
        self.is_cut = False
        held, self._held = self._held, []
        for deliver, size in held:
            self.send(deliver, size)

    def reset(self) -> None:
        """Lose all messages that have not arrived."""
        self._generation += 1
        self._held.clear()

    def _arrive(self, generation: int, deliver: Callable[[], object]) -> None:
        if generation == self._generation and self.receiver.is_alive:
            deliver()
