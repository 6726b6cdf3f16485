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

from bunraku.ingest.result import JobRejection, JobResult

MAX_MEMORY_BYTES = 4 << 30
"""Bytes of address space that a job may take."""
MAX_PROGRESS_REPORTS = 100
"""Times that a job says how far it is, at most: few enough that its pipe never fills."""

JobKind = Literal["make", "keep", "add", "dress", "gather"]
"""`making.make`, `keeping.keep`, `adding.add`, `scenery.dress` or `gathering.gather`."""

_process_context = multiprocessing.get_context("forkserver")
_process_context.set_forkserver_preload(
    [
        "bunraku.ingest.jobs.motion",
        "bunraku.ingest.jobs.recording",
        "bunraku.ingest.jobs.audio",
        "bunraku.ingest.jobs.scene",
        "bunraku.ingest.jobs.performers",
    ]
)


class _FailureTexts(NamedTuple):
    """What is said of a kind of job that did not come to its end."""

    too_large_title: str
    reduce_hint: str
    failed_title: str
    failed_detail: str
    report_hint: str


_FAILURE_TEXTS: dict[JobKind, _FailureTexts] = {
    "make": _FailureTexts(
        "Too much motion",
        "cut the file into shorter ones",
        "Unreadable motion",
        "the reader broke off on this file",
        "please report it with the file",
    ),
    "keep": _FailureTexts(
        "Too much motion",
        "keep a shorter part",
        "Unreadable motion",
        "the replay of this session broke off",
        "please report it",
    ),
    "add": _FailureTexts(
        "Too much sound",
        "send a file that is no longer than the motion",
        "Unreadable sound",
        "the reader broke off on this file",
        "please report it with the file",
    ),
    "dress": _FailureTexts(
        "Too many lights",
        "ask for fewer at once",
        "Unreadable keyframes",
        "the encoder broke off on these keyframes",
        "please report it with the keyframes",
    ),
    "gather": _FailureTexts(
        "Too much motion",
        "let fewer dance, or shorter dances",
        "Unreadable motion",
        "the dances could not be put side by side",
        "please report it",
    ),
}


def _run_in_process(result_sender: Connection, kind: JobKind, arguments: tuple[Any, ...]) -> None:
    from bunraku.ingest.jobs.audio import add_audio
    from bunraku.ingest.jobs.motion import encode_file
    from bunraku.ingest.jobs.performers import combine_performers
    from bunraku.ingest.jobs.recording import encode_recording
    from bunraku.ingest.jobs.scene import add_scene

    works: dict[JobKind, Callable[..., JobResult | JobRejection]] = {
        "make": encode_file,
        "keep": encode_recording,
        "add": add_audio,
        "dress": add_scene,
        "gather": combine_performers,
    }
    work, words = works[kind], _FAILURE_TEXTS[kind]
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    told = -1

    def tell(share: float) -> None:
        nonlocal told
        if int(share * MAX_PROGRESS_REPORTS) > told:
            told = int(share * MAX_PROGRESS_REPORTS)
            result_sender.send(share)

    try:
        result_sender.send(work(*arguments, tell))
    except MemoryError:
        result_sender.send(
            JobRejection(words.too_large_title, "this takes more memory than one may have", hint=words.reduce_hint)
        )


async def run_job(
    kind: JobKind, arguments: tuple[Any, ...], timeout_s: float, progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """A job with its `arguments` in a process of its own, ended after `seconds`; `progress` is told the share done."""
    receiver, sender = _process_context.Pipe(duplex=False)
    process = _process_context.Process(target=_run_in_process, args=(sender, kind, arguments), daemon=True)
    try:
        await _run_uninterrupted(process.start)
        sender.close()
        end = asyncio.get_running_loop().time() + timeout_s
        while True:
            async with asyncio.timeout_at(end):
                await _wait_readable(receiver)
            result = await _run_uninterrupted(receiver.recv)
            if not isinstance(result, float):
                break
            progress(result)
    except TimeoutError:
        return JobRejection(
            "Takes too long",
            f"reading and encoding took more than {timeout_s:g} s",
            hint=_FAILURE_TEXTS[kind].reduce_hint,
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
    if isinstance(result, JobResult | JobRejection):
        return result
    words = _FAILURE_TEXTS[kind]
    return JobRejection(words.failed_title, words.failed_detail, hint=words.report_hint)


async def _run_uninterrupted(work: Callable[[], Any]) -> Any:
    """The result of `work` in a thread. One who is cancelled waits for it all the same: process and pipe are put away
    only when no thread is at them."""
    working = asyncio.ensure_future(asyncio.to_thread(work))
    try:
        return await asyncio.shield(working)
    except asyncio.CancelledError:
        await asyncio.gather(working, return_exceptions=True)
        raise


async def _wait_readable(receiver: Connection) -> None:
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
