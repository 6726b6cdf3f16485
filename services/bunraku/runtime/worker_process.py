"""Run of one function in a separate process, with limits on time and memory.

Work on untrusted input takes seconds of CPU time, needs much memory and can fail in any way. A separate process keeps
the service's event loop free and can be killed. Worker processes are forked from a server process that has imported
the modules of `preload_modules`, so that the service itself need not import them.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
from collections.abc import Callable, Collection
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar, cast

from bunraku.runtime.problem import ProblemError
from bunraku.runtime.sandbox import enter_sandbox, start_worker_server
from bunraku.runtime.worker_message import InvalidWorkerMessage, receive_message, send_message

MAX_MEMORY_BYTES = 4 << 30
"""Address space of a worker process, in bytes."""
MAX_PROGRESS_REPORTS = 100
"""Maximum number of progress reports of one function, few enough that its pipe never fills."""
WORKER_NICENESS = 5
"""Added niceness of a worker process: the services, which have deadlines, run first."""

Result = TypeVar("Result")

_process_context = multiprocessing.get_context("forkserver")
_preloaded_modules: list[str] = []


class WorkerFailed(Exception):
    """A worker process that ended without a result."""


class WorkerTimedOut(WorkerFailed):
    """A worker process that exceeded its time limit and was killed."""


class WorkerOutOfMemory(WorkerFailed):
    """A worker process that exceeded `MAX_MEMORY_BYTES`."""


class WorkerCrashed(WorkerFailed):
    """A worker process that ended with an unexpected exception or a signal."""


_PROGRESS, _RESULT, _PROBLEM, _OUT_OF_MEMORY = "progress", "result", "problem", "out of memory"
"""Kinds of messages of a worker process."""


def preload_modules(*names: str) -> None:
    """Import modules in the server process from which workers are forked. Call it at import, before the first run."""
    _preloaded_modules.extend(name for name in names if name not in _preloaded_modules)
    _process_context.set_forkserver_preload(_preloaded_modules)


async def run_in_worker(
    function: Callable[..., Result],
    arguments: tuple[Any, ...],
    timeout_s: float,
    on_progress: Callable[[float], None] | None = None,
    records: Collection[type] = (),
) -> Result:
    """Return the result of a function of a module, called in a separate, isolated process.

    Arguments are pickled; files that the function reads are paths among them. The result is a plain value, a byte
    string or a dataclass of `records` (`bunraku.runtime.worker_message`). `on_progress` receives the completed share,
    0..1; the function then gets a callable that reports it as a further argument. Raise `ProblemError` if the function
    does, or `WorkerFailed`. Cancellation kills the process.
    """
    receiver, sender = _process_context.Pipe(duplex=False)
    process = _process_context.Process(
        target=_run_worker, args=(sender, function, arguments, timeout_s, on_progress is not None), daemon=True
    )
    kind, value = "", None
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
                kind, value = await _run_uninterrupted(lambda: receive_message(receiver, records), process.kill)
            if kind != _PROGRESS or on_progress is None or not isinstance(value, float) or not 0.0 <= value <= 1.0:
                break
            on_progress(value)
    except TimeoutError:
        raise WorkerTimedOut(f"the worker process exceeded {timeout_s:g} s") from None
    except (EOFError, InvalidWorkerMessage) as error:
        raise WorkerCrashed("the worker process ended without a result") from error
    finally:
        if process.pid is not None:
            process.kill()
            await asyncio.to_thread(process.join)
            process.close()
        sender.close()
        receiver.close()
    return cast(Result, _read_outcome(kind, value))


def _read_outcome(kind: str, value: Any) -> Any:
    """Return the result of a worker's last message, or raise what it stands for."""
    if kind == _RESULT:
        return value
    if kind == _OUT_OF_MEMORY:
        raise WorkerOutOfMemory(f"the worker process needs more than {MAX_MEMORY_BYTES >> 30} GiB of memory")
    if kind == _PROBLEM:
        try:
            problem = ProblemError.from_dict(value)
        except TypeError:
            raise WorkerCrashed("the worker process sent an invalid problem") from None
        raise problem
    raise WorkerCrashed("the worker process sent no result")


def _run_worker(
    result_sender: Connection,
    function: Callable[..., Any],
    arguments: tuple[Any, ...],
    timeout_s: float,
    reports_progress: bool,
) -> None:
    """Run in the worker process: call the function and send its outcome."""
    os.nice(WORKER_NICENESS)
    input_files = [argument for argument in arguments if isinstance(argument, Path)]
    enter_sandbox(result_sender.fileno(), input_files, MAX_MEMORY_BYTES, timeout_s)
    last_report = -1

    def report_progress(share: float) -> None:
        nonlocal last_report
        if int(share * MAX_PROGRESS_REPORTS) > last_report:
            last_report = int(share * MAX_PROGRESS_REPORTS)
            send_message(result_sender, _PROGRESS, share)

    try:
        result = function(*arguments, report_progress) if reports_progress else function(*arguments)
        send_message(result_sender, _RESULT, result)
    except ProblemError as error:
        send_message(result_sender, _PROBLEM, error.to_dict())
    except MemoryError:
        send_message(result_sender, _OUT_OF_MEMORY, None)


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
