"""UDP receiver for tests: a real socket that collects the datagrams sent to it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from tests.time_limit import HANG_TIMEOUT_S


class DatagramReceiver(asyncio.DatagramProtocol):
    """Datagrams received so far, in `received`, at `port` of 127.0.0.1."""

    def __init__(self) -> None:
        self.received: list[bytes] = []
        self.port = 0
        self._arrived = asyncio.Condition()
        self._notifying: set[asyncio.Task[None]] = set()

    def datagram_received(self, data: bytes, _: Any) -> None:
        self.received.append(data)
        task = asyncio.ensure_future(self._notify())
        self._notifying.add(task)
        task.add_done_callback(self._notifying.discard)

    async def wait_until(self, condition: Callable[[list[bytes]], bool]) -> None:
        """Wait until the received datagrams fulfil a condition."""
        async with asyncio.timeout(HANG_TIMEOUT_S), self._arrived:
            await self._arrived.wait_for(lambda: condition(self.received))

    async def _notify(self) -> None:
        async with self._arrived:
            self._arrived.notify_all()


@asynccontextmanager
async def receive_datagrams(port: int = 0) -> AsyncIterator[DatagramReceiver]:
    """Open a receiver at a free port, or at `port`."""
    loop = asyncio.get_running_loop()
    transport, receiver = await loop.create_datagram_endpoint(DatagramReceiver, local_addr=("127.0.0.1", port))
    receiver.port = transport.get_extra_info("sockname")[1]
    try:
        yield receiver
    finally:
        transport.close()
