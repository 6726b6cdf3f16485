"""Jobs of the ingest service, each run in a worker process.

The modules that jobs need are imported only in the server process from which worker processes are forked.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.readers.takes import TakeList
from bunraku.runtime import worker_process
from bunraku.runtime.worker_process import MAX_MEMORY_BYTES, WorkerFailed, WorkerOutOfMemory, WorkerTimedOut

Result = TypeVar("Result")


class JobKind(StrEnum):
    """Kind of a job; the values are labels of metrics and log lines."""

    MOTION = "make"
    RECORDING = "keep"
    AUDIO = "add"
    SCENE = "dress"
    PERFORMERS = "gather"
    PERFORMANCE = "perform"
    EDIT = "edit"
    REENCODING = "reencode"
    PROP = "shape"


worker_process.preload_modules(
    "bunraku.ingest.jobs.motion",
    "bunraku.ingest.jobs.recording",
    "bunraku.ingest.jobs.audio",
    "bunraku.ingest.jobs.scene",
    "bunraku.ingest.jobs.performers",
    "bunraku.ingest.jobs.performance",
    "bunraku.ingest.jobs.edit",
    "bunraku.ingest.jobs.reencoding",
    "bunraku.ingest.jobs.prop",
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
    JobKind.PERFORMANCE: _FailureTexts(
        "Too much motion",
        "perform for a shorter time",
        "Unreadable motion",
        "encoding this performance crashed",
        "please report it",
    ),
    JobKind.EDIT: _FailureTexts(
        "Too much motion",
        "cut out a shorter part",
        "Unreadable motion",
        "editing this motion crashed",
        "please report it",
    ),
    JobKind.REENCODING: _FailureTexts(
        "Too much motion",
        "leave it as it is stored",
        "Unreadable motion",
        "encoding this motion again crashed",
        "please report it",
    ),
    JobKind.PROP: _FailureTexts(
        "Too large a prop",
        "simplify it, and reduce its images, before the export",
        "Unreadable prop",
        "the reader crashed on this file",
        "please report it with the file",
    ),
}


async def run_job(
    kind: JobKind, arguments: tuple[Any, ...], timeout_s: float, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Run a job in a worker process and return its result, or a rejection if it crashes or exceeds a limit.

    `on_progress` receives the completed share, 0..1. Cancellation kills the process.
    """
    return await _run(kind, _call_job, (kind, *arguments), timeout_s, on_progress, (JobResult, JobRejection))


async def list_takes(path: Path, limit: int, timeout_s: float) -> TakeList | JobRejection:
    """Return the first `limit` takes of a motion file, read in a worker process, or a rejection as `run_job` does."""
    records = (TakeList, JobRejection)
    try:
        return await worker_process.run_in_worker(_call_list_takes, (path, limit), timeout_s, None, records)
    except WorkerFailed:
        # one file of an archive may be too much for its reader: unopened, each file is one take
        return await _run(JobKind.MOTION, _call_list_files, (path, limit), timeout_s, None, records)


async def _run(
    kind: JobKind,
    function: Callable[..., Result | JobRejection],
    arguments: tuple[Any, ...],
    timeout_s: float,
    on_progress: Callable[[float], None] | None,
    records: Collection[type],
) -> Result | JobRejection:
    texts = _FAILURE_TEXTS[kind]
    try:
        return await worker_process.run_in_worker(function, arguments, timeout_s, on_progress, records)
    except WorkerTimedOut:
        detail = f"reading and encoding exceeded {timeout_s:g} s"
        return JobRejection("Takes too long", detail, hint=texts.reduce_hint)
    except WorkerOutOfMemory:
        detail = f"it needs more than {MAX_MEMORY_BYTES >> 30} GiB of memory"
        return JobRejection(texts.too_large_title, detail, hint=texts.reduce_hint)
    except WorkerFailed:
        return JobRejection(texts.failed_title, texts.failed_detail, hint=texts.report_hint)


def _call_list_takes(path: Path, limit: int) -> TakeList | JobRejection:
    """List takes, in the worker process."""
    from bunraku.ingest.jobs.motion import list_file_takes

    return list_file_takes(path, limit)


def _call_list_files(path: Path, limit: int) -> TakeList | JobRejection:
    """List takes without opening the files of an archive, in the worker process."""
    from bunraku.ingest.jobs.motion import list_file_takes

    return list_file_takes(path, limit, opens_files=False)


def _call_job(kind: JobKind, *arguments: Any) -> JobResult | JobRejection:
    """Call the function of a job, in the worker process."""
    from bunraku.ingest.jobs.audio import add_audio
    from bunraku.ingest.jobs.edit import edit_motion
    from bunraku.ingest.jobs.motion import encode_file
    from bunraku.ingest.jobs.performance import encode_performance
    from bunraku.ingest.jobs.performers import combine_performers
    from bunraku.ingest.jobs.prop import make_prop
    from bunraku.ingest.jobs.recording import encode_recording
    from bunraku.ingest.jobs.reencoding import reencode_motion
    from bunraku.ingest.jobs.scene import add_scene_of_body

    functions: dict[JobKind, Callable[..., JobResult | JobRejection]] = {
        JobKind.MOTION: encode_file,
        JobKind.RECORDING: encode_recording,
        JobKind.AUDIO: add_audio,
        JobKind.SCENE: add_scene_of_body,
        JobKind.PERFORMERS: combine_performers,
        JobKind.PERFORMANCE: encode_performance,
        JobKind.EDIT: edit_motion,
        JobKind.REENCODING: reencode_motion,
        JobKind.PROP: make_prop,
    }
    return functions[kind](*arguments)
