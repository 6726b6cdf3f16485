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
import resource
from collections.abc import Callable
from enum import Enum, auto
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from bunraku.runtime.problem import ProblemError

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


class _Outcome(Enum):
    """Kind of a message from a worker process."""

    PROGRESS = auto()
    RESULT = auto()
    PROBLEM = auto()
    OUT_OF_MEMORY = auto()


def preload_modules(*names: str) -> None:
    """Import modules in the server process from which workers are forked. Call it at import, before the first run."""
    _preloaded_modules.extend(name for name in names if name not in _preloaded_modules)
    _process_context.set_forkserver_preload(_preloaded_modules)


async def run_in_worker(
    function: Callable[..., Result],
    arguments: tuple[Any, ...],
    timeout_s: float,
    on_progress: Callable[[float], None] | None = None,
) -> Result:
    """Return the result of a function of a module, called in a separate process.

    Arguments and result are pickled. `on_progress` receives the completed share, 0..1; the function then gets a
    callable that reports it as a further argument. Raise `ProblemError` if the function does, or `WorkerFailed`.
    Cancellation kills the process.
    """
    receiver, sender = _process_context.Pipe(duplex=False)
    process = _process_context.Process(
        target=_run_worker, args=(sender, function, arguments, on_progress is not None), daemon=True
    )
    try:
        await _run_uninterrupted(process.start)
        sender.close()
        deadline = asyncio.get_running_loop().time() + timeout_s
        while True:
            async with asyncio.timeout_at(deadline):
                await _wait_readable(receiver)
            outcome, value = await _run_uninterrupted(receiver.recv)
            if outcome is not _Outcome.PROGRESS:
                break
            if on_progress is not None:
                on_progress(value)
    except TimeoutError:
        raise WorkerTimedOut(f"the worker process exceeded {timeout_s:g} s") from None
    except EOFError:
        raise WorkerCrashed("the worker process ended without a result") from None
    finally:
        if process.pid is not None:
            process.kill()
            await asyncio.to_thread(process.join)
            process.close()
        sender.close()
        receiver.close()
    if outcome is _Outcome.PROBLEM:
        raise ProblemError.from_dict(value)
    if outcome is _Outcome.OUT_OF_MEMORY:
        raise WorkerOutOfMemory(f"the worker process needs more than {MAX_MEMORY_BYTES >> 30} GiB of memory")
    result: Result = value
    return result


def _run_worker(
    result_sender: Connection, function: Callable[..., Any], arguments: tuple[Any, ...], reports_progress: bool
) -> None:
    """Run in the worker process: call the function and send its outcome."""
    _restrict_process()
    last_report = -1

    def report_progress(share: float) -> None:
        nonlocal last_report
        if int(share * MAX_PROGRESS_REPORTS) > last_report:
            last_report = int(share * MAX_PROGRESS_REPORTS)
            result_sender.send((_Outcome.PROGRESS, share))

    try:
        result = function(*arguments, report_progress) if reports_progress else function(*arguments)
        result_sender.send((_Outcome.RESULT, result))
    except ProblemError as error:
        result_sender.send((_Outcome.PROBLEM, error.to_dict()))
    except MemoryError:
        result_sender.send((_Outcome.OUT_OF_MEMORY, None))


def _restrict_process() -> None:
    """Restrict this worker process before it sees any input."""
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    os.nice(WORKER_NICENESS)


async def _run_uninterrupted(function: Callable[[], Any]) -> Any:
    """Return the result of `function` in a thread, and wait for the thread even when cancelled.

    Process and pipe must not be closed while a thread uses them.
    """
    running = asyncio.ensure_future(asyncio.to_thread(function))
    try:
        return await asyncio.shield(running)
    except asyncio.CancelledError:
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
