"""What Bunraku's line room is measured against: every message written as it comes, whatever the line carries."""

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
    """A relay at `port`: writes each viewer all that a stream at `url` says, at once, and hands back what it says."""

    async def relay(viewer: ServerConnection) -> None:
        async with connect(
            url, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, max_size=MAX_SERVER_MESSAGE_BYTES
        ) as stage:

            async def there() -> None:
                # what is not read here is kept by the kernel: as much as a server that only writes would let it keep
                async for message in stage:
                    viewer.transport.set_write_buffer_limits(high=1 << 24)
                    await viewer.send(message)

            async def back() -> None:
                async for message in viewer:
                    await stage.send(message)

            ways = [asyncio.create_task(there()), asyncio.create_task(back())]
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in ways:
                way.cancel()
            for end in await asyncio.gather(*ways, return_exceptions=True):
                if isinstance(end, Exception) and not isinstance(end, ConnectionClosed):
                    raise end

    async with serve(
        relay, "0.0.0.0", port, subprotocols=[Subprotocol(SUBPROTOCOL)], compression=None, ping_interval=None
    ):
        yield
