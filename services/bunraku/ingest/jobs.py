"""An upload's bytes, or a session's log, to an encoded motion or sound, in a process of its own.

Reading strangers' files and encoding motions takes seconds of processor time and may go wrong in any way: a process
apart keeps the service's loop free, and can be ended when it takes too long or too much. What a job needs is loaded in
the process that jobs are forked from, never in the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import resource
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, Literal, NamedTuple

from bunraku.ingest.results import Made, Refused

MEMORY = 4 << 30
"""Bytes of address space that a job may take."""
SHARES = 100
"""Times that a job says how far it is, at most: few enough that its pipe never fills."""

Job = Literal["make", "keep", "add", "dress", "gather"]
"""`making.make`, `keeping.keep`, `adding.add`, `scenery.dress` or `gathering.gather`."""

_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(
    [
        "bunraku.ingest.making",
        "bunraku.ingest.keeping",
        "bunraku.ingest.adding",
        "bunraku.ingest.scenery",
        "bunraku.ingest.gathering",
    ]
)


class _Words(NamedTuple):
    """What is said of a kind of job that did not come to its end."""

    too_much: str
    shorter: str
    unreadable: str
    broken_off: str
    report: str


_WORDS: dict[Job, _Words] = {
    "make": _Words(
        "Too much motion",
        "cut the file into shorter ones",
        "Unreadable motion",
        "the reader broke off on this file",
        "please report it with the file",
    ),
    "keep": _Words(
        "Too much motion",
        "keep a shorter part",
        "Unreadable motion",
        "the replay of this session broke off",
        "please report it",
    ),
    "add": _Words(
        "Too much sound",
        "send a file that is no longer than the motion",
        "Unreadable sound",
        "the reader broke off on this file",
        "please report it with the file",
    ),
    "dress": _Words(
        "Too many lights",
        "ask for fewer at once",
        "Unreadable keyframes",
        "the encoder broke off on these keyframes",
        "please report it with the keyframes",
    ),
    "gather": _Words(
        "Too much motion",
        "let fewer dance, or shorter dances",
        "Unreadable motion",
        "the dances could not be put side by side",
        "please report it",
    ),
}


def _work(answer: Connection, job: Job, arguments: tuple[Any, ...]) -> None:
    from bunraku.ingest.adding import add
    from bunraku.ingest.gathering import gather
    from bunraku.ingest.keeping import keep
    from bunraku.ingest.making import make
    from bunraku.ingest.scenery import dress

    works: dict[Job, Callable[..., Made | Refused]] = {
        "make": make,
        "keep": keep,
        "add": add,
        "dress": dress,
        "gather": gather,
    }
    work, words = works[job], _WORDS[job]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    told = -1

    def tell(share: float) -> None:
        nonlocal told
        if int(share * SHARES) > told:
            told = int(share * SHARES)
            answer.send(share)

    try:
        answer.send(work(*arguments, tell))
    except MemoryError:
        answer.send(Refused(words.too_much, "this takes more memory than one may have", hint=words.shorter))


async def run(
    job: Job, arguments: tuple[Any, ...], seconds: float, progress: Callable[[float], None] = lambda _: None
) -> Made | Refused:
    """A job with its `arguments` in a process of its own, ended after `seconds`; `progress` is told the share done."""
    receiver, sender = _context.Pipe(duplex=False)
    process = _context.Process(target=_work, args=(sender, job, arguments), daemon=True)
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
        return Refused("Takes too long", f"reading and encoding took more than {seconds:g} s", hint=_WORDS[job].shorter)
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
    words = _WORDS[job]
    return Refused(words.unreadable, words.broken_off, hint=words.report)


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
            # a loop that polls for itself (uvloop's does) leaves the pipe unblocking; it is read whole in a thread
            os.set_blocking(number, True)
