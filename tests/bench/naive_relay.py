"""Baseline for congestion control: a relay that writes every message as it arrives, regardless of the link."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from bunraku.wire.messages import MAX_SERVER_MESSAGE_BYTES, SUBPROTOCOL


@asynccontextmanager
async def naive_relay(url: str, port: int) -> AsyncIterator[None]:
    """Run a relay at `port` between viewers and the stream at `url`, without any limit on queued data."""

    async def relay(viewer: ServerConnection) -> None:
        async with connect(
            url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, max_size=MAX_SERVER_MESSAGE_BYTES
        ) as server:

            async def forward() -> None:
                # unread messages stay in the kernel, as much as a server that only writes would have there
                async for message in server:
                    viewer.transport.set_write_buffer_limits(high=1 << 24)
                    await viewer.send(message)

            async def send_back() -> None:
                async for message in viewer:
                    await server.send(message)

            tasks = [asyncio.create_task(forward()), asyncio.create_task(send_back())]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in tasks:
                task.cancel()
            for outcome in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(outcome, Exception) and not isinstance(outcome, ConnectionClosed):
                    raise outcome

    async with serve(
        relay, "0.0.0.0", port, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, ping_interval=None
    ):
        yield
