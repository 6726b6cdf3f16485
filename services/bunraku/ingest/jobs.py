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
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from bunraku.ingest.results import Made, Refused

MEMORY = 4 << 30
"""Bytes of address space that a job may take."""
SHARES = 100
"""Times that a job says how far it is, at most: few enough that its pipe never fills."""

_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(["bunraku.ingest.making"])


def _work(answer: Connection, motion: str, path: Path) -> None:
    from bunraku.ingest.making import make

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    told = -1

    def tell(share: float) -> None:
        nonlocal told
        if int(share * SHARES) > told:
            told = int(share * SHARES)
            answer.send(share)

    try:
        answer.send(make(motion, path, tell))
    except MemoryError:
        answer.send(
            Refused(
                "Too much motion", "reading this file takes more memory than one may", hint="cut it into shorter files"
            )
        )


async def run(
    motion: str, path: Path, seconds: float, progress: Callable[[float], None] = lambda _: None
) -> Made | Refused:
    """`making.make` in a process of its own, ended after `seconds`."""
    receiver, sender = _context.Pipe(duplex=False)
    process = _context.Process(target=_work, args=(sender, motion, path), daemon=True)
    try:
        await _to_its_end(process.start)
        sender.close()
        end = asyncio.get_running_loop().time() + seconds
        while True:
            async with asyncio.timeout_at(end):
                await _readable(receiver)
            result = await _to_its_end(receiver.recv)
            if not isinstance(result, float):
                break
            progress(result)
    except TimeoutError:
        return Refused(
            "Takes too long",
            f"reading and encoding took more than {seconds:g} s",
            hint="cut the file into shorter ones",
        )
    except EOFError:
        result = None
    finally:
        if process.pid is not None:
            process.kill()
            await asyncio.to_thread(process.join)
            process.close()
        sender.close()
        receiver.close()
    if isinstance(result, Made | Refused):
        return result
    return Refused("Unreadable motion", "the reader broke off on this file", hint="please report it with the file")


async def _to_its_end(work: Callable[[], Any]) -> Any:
    """The result of `work` in a thread. One who is cancelled waits for it all the same: process and pipe are put away
    only when no thread is at them."""
    working = asyncio.ensure_future(asyncio.to_thread(work))
    try:
        return await asyncio.shield(working)
    except asyncio.CancelledError:
        await asyncio.gather(working, return_exceptions=True)
        raise


async def _readable(receiver: Connection) -> None:
    """Wait until something has come through the pipe, or it was closed."""
    loop = asyncio.get_running_loop()
    arrived: asyncio.Future[None] = loop.create_future()
    number = receiver.fileno()

    def come() -> None:
        if not arrived.done():
            arrived.set_result(None)

    loop.add_reader(number, come)
    try:
        await arrived
    finally:
        with contextlib.suppress(ValueError, OSError):
            loop.remove_reader(number)
