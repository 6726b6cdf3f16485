"""Reverse proxy between viewers and a server, like a gateway.

It buffers data that a viewer's link does not accept, and adds X-Forwarded-For.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

MIN_BUFFER_BYTES = 1 << 18
"""Size of the buffer for each viewer."""


@asynccontextmanager
async def run_reverse_proxy(port: int, *, host: str = "127.0.0.1", listen_port: int = 0) -> AsyncIterator[int]:
    """Run a proxy for the server at a local port. Yield the port of the proxy."""

    async def forward(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(1 << 16):
            writer.write(data)
            await writer.drain()

    async def relay(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        request_line, _, rest = (await reader.readuntil(b"\r\n\r\n")).partition(b"\r\n")
        upstream_reader, upstream_writer = await asyncio.open_connection("127.0.0.1", port)
        peer = writer.get_extra_info("peername")[0].encode()
        upstream_writer.write(request_line + b"\r\nX-Forwarded-For: " + peer + b"\r\n" + rest)
        writer.transport.set_write_buffer_limits(high=MIN_BUFFER_BYTES)
        tasks = [
            asyncio.create_task(forward(reader, upstream_writer)),
            asyncio.create_task(forward(upstream_reader, writer)),
        ]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            for end in (writer, upstream_writer):
                end.transport.abort()

    connections: set[asyncio.Task[None]] = set()

    def on_connect(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        async def handle() -> None:
            with suppress(OSError, asyncio.IncompleteReadError):
                await relay(reader, writer)

        task = asyncio.create_task(handle())
        connections.add(task)
        task.add_done_callback(connections.discard)

    server = await asyncio.start_server(on_connect, host, listen_port)
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        for task in tuple(connections):
            task.cancel()
        await asyncio.gather(*connections, return_exceptions=True)
