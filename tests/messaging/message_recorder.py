"""Helpers for tests of a bus."""

from __future__ import annotations

import asyncio

from bunraku.messaging.bus import Bus
from tests.time_limit import HANG_TIMEOUT_S


class MessageRecorder:
    """Message handler that records messages and waits for them."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self._received = asyncio.Event()

    def __call__(self, message: bytes) -> None:
        self.messages.append(message)
        self._received.set()

    async def wait_for(self, last: bytes) -> list[bytes]:
        """Wait until `last` is the latest message and return all messages."""
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not self.messages or self.messages[-1] != last:
                self._received.clear()
                await self._received.wait()
        return self.messages


async def flush_buses(*buses: Bus) -> None:
    """Wait until all previous commands are effective: a response arrives after them."""
    for bus in buses:

        async def respond(_: bytes) -> bytes:
            return b""

        subject = f"settled.{id(bus)}"
        subscription = bus.serve(subject, respond)
        await bus.request(subject)
        subscription.unsubscribe()
