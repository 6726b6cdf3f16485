"""Run of one job in a separate process.

Parsing untrusted files and encoding motions takes seconds of CPU time and can fail in any way. A separate process keeps
the service's event loop free and can be killed when it exceeds its time or memory. The modules that jobs need are
imported in the server process from which jobs are forked, never in the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
from collections.abc import Callable
from enum import StrEnum
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

from bunraku.ingest.result import JobRejection, JobResult
from bunraku.runtime.sandbox import enter_sandbox, start_worker_server
from bunraku.runtime.worker_message import InvalidWorkerMessage, receive_message, send_message

MAX_MEMORY_BYTES = 4 << 30
"""Address space of a job's process, in bytes."""
MAX_PROGRESS_REPORTS = 100
"""Maximum number of progress reports of a job, few enough that its pipe never fills."""
_PROGRESS, _RESULT = "progress", "result"
"""Kinds of messages of a job's process: the completed share, and a `JobResult` or `JobRejection`."""


class JobKind(StrEnum):
    """Kind of a job; the values are labels of metrics and log lines."""

    MOTION = "make"
    RECORDING = "keep"
    AUDIO = "add"
    SCENE = "dress"
    PERFORMERS = "gather"


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
    """Texts for a job that exceeds its limits or crashes."""

    too_large_title: str
    reduce_hint: str
    failed_title: str
    failed_detail: str
    report_hint: str


_FAILURE_TEXTS: dict[JobKind, _FailureTexts] = {
    JobKind.MOTION: _FailureTexts(
        "Too much motion",
        "cut the file into shorter ones",
        "Unreadable motion",
        "the parser crashed on this file",
        "please report it with the file",
    ),
    JobKind.RECORDING: _FailureTexts(
        "Too much motion",
        "record a shorter part",
        "Unreadable motion",
        "the replay of this session crashed",
        "please report it",
    ),
    JobKind.AUDIO: _FailureTexts(
        "Too much sound",
        "upload a file that is no longer than the motion",
        "Unreadable sound",
        "the decoder crashed on this file",
        "please report it with the file",
    ),
    JobKind.SCENE: _FailureTexts(
        "Too many lights",
        "add fewer at once",
        "Unreadable keyframes",
        "the encoder crashed on these keyframes",
        "please report it with the keyframes",
    ),
    JobKind.PERFORMERS: _FailureTexts(
        "Too much motion",
        "combine fewer or shorter motions",
        "Unreadable motion",
        "combining these motions crashed",
        "please report it",
    ),
}


def _run_in_process(result_sender: Connection, kind: JobKind, arguments: tuple[Any, ...], timeout_s: float) -> None:
    input_files = [argument for argument in arguments if isinstance(argument, Path)]
    enter_sandbox(result_sender.fileno(), input_files, MAX_MEMORY_BYTES, timeout_s)
    from bunraku.ingest.jobs.audio import add_audio
    from bunraku.ingest.jobs.motion import encode_file
    from bunraku.ingest.jobs.performers import combine_performers
    from bunraku.ingest.jobs.recording import encode_recording
    from bunraku.ingest.jobs.scene import add_scene

    functions: dict[JobKind, Callable[..., JobResult | JobRejection]] = {
        JobKind.MOTION: encode_file,
        JobKind.RECORDING: encode_recording,
        JobKind.AUDIO: add_audio,
        JobKind.SCENE: add_scene,
        JobKind.PERFORMERS: combine_performers,
    }
    last_report = -1

    def report_progress(share: float) -> None:
        nonlocal last_report
        if int(share * MAX_PROGRESS_REPORTS) > last_report:
            last_report = int(share * MAX_PROGRESS_REPORTS)
            send_message(result_sender, _PROGRESS, share)

    try:
        send_message(result_sender, _RESULT, functions[kind](*arguments, report_progress))
    except MemoryError:
        texts = _FAILURE_TEXTS[kind]
        detail = f"it needs more than {MAX_MEMORY_BYTES >> 30} GiB of memory"
        send_message(result_sender, _RESULT, JobRejection(texts.too_large_title, detail, hint=texts.reduce_hint))


async def run_job(
    kind: JobKind, arguments: tuple[Any, ...], timeout_s: float, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Run a job in a separate process and return its result, or a rejection if it crashes or exceeds `timeout_s`.

    `on_progress` receives the completed share, 0..1. Cancellation kills the process.
    """
    receiver, sender = _process_context.Pipe(duplex=False)
    process = _process_context.Process(target=_run_in_process, args=(sender, kind, arguments, timeout_s), daemon=True)
    texts = _FAILURE_TEXTS[kind]
    try:
        await _run_uninterrupted(start_worker_server)
        await _run_uninterrupted(process.start)
        sender.close()
        deadline = asyncio.get_running_loop().time() + timeout_s
        # a worker that sends more, or anything else, is not intact
        for _ in range(MAX_PROGRESS_REPORTS + 2):
            async with asyncio.timeout_at(deadline):
                await _wait_readable(receiver)
                # killed first, as it may stop in the middle of a message
                message_kind, value = await _run_uninterrupted(
                    lambda: receive_message(receiver, (JobResult, JobRejection)), process.kill
                )
            if message_kind == _RESULT and isinstance(value, JobResult | JobRejection):
                return value
            if message_kind != _PROGRESS or not isinstance(value, float) or not 0.0 <= value <= 1.0:
                break
            on_progress(value)
    except TimeoutError:
        detail = f"reading and encoding exceeded {timeout_s:g} s"
        return JobRejection("Takes too long", detail, hint=texts.reduce_hint)
    except (EOFError, InvalidWorkerMessage):
        pass
    finally:
        if process.pid is not None:
            process.kill()
            await asyncio.to_thread(process.join)
            process.close()
        sender.close()
        receiver.close()
    return JobRejection(texts.failed_title, texts.failed_detail, hint=texts.report_hint)


async def _run_uninterrupted(function: Callable[[], Any], on_cancel: Callable[[], None] = lambda: None) -> Any:
    """Return the result of `function` in a thread. When cancelled, call `on_cancel` and wait for the thread.

    Process and pipe must not be closed while a thread uses them.
    """
    running = asyncio.ensure_future(asyncio.to_thread(function))
    try:
        return await asyncio.shield(running)
    except asyncio.CancelledError:
        on_cancel()
        await asyncio.gather(running, return_exceptions=True)
        raise


async def _wait_readable(receiver: Connection) -> None:
    """Wait until the pipe has data or is closed."""
    loop = asyncio.get_running_loop()
    readable: asyncio.Future[None] = loop.create_future()
    file_descriptor = receiver.fileno()

    def on_readable() -> None:
        if not readable.done():
            readable.set_result(None)

    loop.add_reader(file_descriptor, on_readable)
    try:
        await readable
    finally:
        with contextlib.suppress(ValueError, OSError):
            loop.remove_reader(file_descriptor)
            # uvloop leaves the pipe non-blocking; `recv` in a thread needs it blocking
            os.set_blocking(file_descriptor, True)
