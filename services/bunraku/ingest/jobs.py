"""An upload's bytes to an encoded motion, in a process of its own.

Reading strangers' files and encoding them takes seconds of processor time and may go wrong in any way: a process apart
keeps the service's loop free, and can be ended when it takes too long or too much. What a job needs is loaded in the
process that jobs are forked from, never in the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import resource
from multiprocessing.connection import Connection
from pathlib import Path

from bunraku.ingest.results import Made, Refused

MEMORY = 4 << 30
"""Bytes of address space that a job may take."""

_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(["bunraku.ingest.making"])


def _work(answer: Connection, motion: str, path: Path) -> None:
    from bunraku.ingest.making import make

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        answer.send(make(motion, path))
    except MemoryError:
        answer.send(
            Refused(
                "Too much motion", "reading this file takes more memory than one may", hint="cut it into shorter files"
            )
        )


async def run(motion: str, path: Path, seconds: float) -> Made | Refused:
    """`making.make` in a process of its own, ended after `seconds`."""
    receiver, sender = _context.Pipe(duplex=False)
    process = _context.Process(target=_work, args=(sender, motion, path), daemon=True)
    await asyncio.to_thread(process.start)
    sender.close()
    try:
        async with asyncio.timeout(seconds):
            arrived = await _readable(receiver)
        result = await asyncio.to_thread(receiver.recv) if arrived else None
    except TimeoutError:
        return Refused(
            "Takes too long",
            f"reading and encoding took more than {seconds:g} s",
            hint="cut the file into shorter ones",
        )
    except EOFError:
        result = None
    finally:
        process.kill()
        await asyncio.to_thread(process.join)
        process.close()
        receiver.close()
    if isinstance(result, Made | Refused):
        return result
    return Refused("Unreadable motion", "the reader broke off on this file", hint="please report it with the file")


async def _readable(receiver: Connection) -> bool:
    """Wait until something has come through the pipe, or it was closed."""
    loop = asyncio.get_running_loop()
    arrived: asyncio.Future[bool] = loop.create_future()
    number = receiver.fileno()

    def come() -> None:
        if not arrived.done():
            arrived.set_result(True)

    loop.add_reader(number, come)
    try:
        return await arrived
    finally:
        with contextlib.suppress(ValueError, OSError):
            loop.remove_reader(number)
