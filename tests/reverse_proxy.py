"""A proxy between a viewer and the server, as a gateway is: it takes what it is given, keeps what the viewer's line
does not carry, and says for whom it asks."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

MIN_BUFFER_BYTES = 1 << 18
"""Bytes that it keeps for a viewer, at the least."""


@asynccontextmanager
async def run_reverse_proxy(port: int, *, host: str = "127.0.0.1", listen_port: int = 0) -> AsyncIterator[int]:
    """One for the server at a port of this machine; tells its own port, `at` where that is given."""

    async def passed(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(1 << 16):
            writer.write(data)
            await writer.drain()

    async def relayed(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        request, _, head = (await reader.readuntil(b"\r\n\r\n")).partition(b"\r\n")
        there, back = await asyncio.open_connection("127.0.0.1", port)
        peer = writer.get_extra_info("peername")[0].encode()
        back.write(request + b"\r\nX-Forwarded-For: " + peer + b"\r\n" + head)
        writer.transport.set_write_buffer_limits(high=MIN_BUFFER_BYTES)
        ways = [asyncio.create_task(passed(reader, back)), asyncio.create_task(passed(there, writer))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
            for end in (writer, back):
                end.transport.abort()

    open_ones: set[asyncio.Task[None]] = set()

    def opened(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def whole() -> None:
            with suppress(OSError, asyncio.IncompleteReadError):
                await relayed(reader, writer)

        task = asyncio.create_task(whole())
        open_ones.add(task)
        task.add_done_callback(open_ones.discard)

    server = await asyncio.start_server(opened, host, listen_port)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for task in tuple(open_ones):
            task.cancel()
        await asyncio.gather(*open_ones, return_exceptions=True)
