from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from bunraku.ingest import job_process
from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.readers.takes import TakeList
from bunraku.runtime import worker_process
from bunraku.runtime.worker_message import send_message
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_zip
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


async def test_job_encodes_a_motion_in_another_process(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.5))
    shares: list[float] = []
    result = await job_process.run_job(JobKind.MOTION, ("m1", source, None, False), HANG_TIMEOUT_S, shares.append)
    assert isinstance(result, JobResult)
    assert result.description["frames"] == 15
    assert shares == sorted(set(shares))
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    assert 5 < len(shares) <= worker_process.MAX_PROGRESS_REPORTS + 1


async def test_crashed_job_is_a_rejection(tmp_path: Path) -> None:
    result = await job_process.run_job(JobKind.MOTION, ("m1", tmp_path / "missing", None, False), HANG_TIMEOUT_S)
    assert isinstance(result, JobRejection)
    assert result.hint


async def test_cancelled_job_is_killed(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(60.0))
    encoding = asyncio.Event()
    job = asyncio.create_task(
        job_process.run_job(JobKind.MOTION, ("m1", source, None, False), HANG_TIMEOUT_S, lambda _: encoding.set())
    )
    await encoding.wait()
    job.cancel()
    with pytest.raises(asyncio.CancelledError):
        await job
    assert not multiprocessing.active_children()


async def test_job_is_killed_at_its_time_limit(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(20.0))
    rejected = await job_process.run_job(JobKind.MOTION, ("m1", source, None, False), 0.001)
    assert isinstance(rejected, JobRejection)
    assert "long" in rejected.title


def stop_within_a_message(sender: Connection, *_: object) -> None:
    # the length of a message, without the message
    os.write(sender.fileno(), (1_000).to_bytes(4, "big"))
    signal.pause()


def report_for_ever(sender: Connection, *_: object) -> None:
    while True:
        send_message(sender, "progress", 0.5)


def report_nonsense(sender: Connection, *_: object) -> None:
    send_message(sender, "progress", float("nan"))
    send_message(sender, "result", JobResult(b"m", {}))


@pytest.mark.parametrize(
    ("worker", "timeout_s", "title"),
    [
        (stop_within_a_message, 3.0, "Takes too long"),
        (report_for_ever, HANG_TIMEOUT_S, "Unreadable"),
        (report_nonsense, HANG_TIMEOUT_S, "Unreadable"),
    ],
)
async def test_hostile_worker_is_a_rejection(
    worker: Callable[..., None], timeout_s: float, title: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_process, "_run_worker", worker)
    result = await job_process.run_job(JobKind.MOTION, ("m1",), timeout_s)
    assert isinstance(result, JobRejection)
    assert result.title.startswith(title)
    assert not multiprocessing.active_children()


async def test_takes_are_listed_in_another_process(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(write_fbx(takes=("walk", "run")))
    assert await job_process.list_takes(source, 1, HANG_TIMEOUT_S) == TakeList(["walk"], 2)
    source.write_bytes(b"PK\x03\x04" + bytes(100))
    rejected = await job_process.list_takes(source, 1, HANG_TIMEOUT_S)
    assert isinstance(rejected, JobRejection)
    assert rejected.title == "Broken archive"


def crash(_: Path, __: int) -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


async def test_files_of_an_archive_that_crash_their_reader_are_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_process, "_call_list_takes", crash)
    source = tmp_path / "source"
    source.write_bytes(write_zip({"a.fbx": write_fbx(takes=("walk", "run")), "b.bvh": b"x"}))
    assert await job_process.list_takes(source, 9, HANG_TIMEOUT_S) == TakeList(["a.fbx", "b.bvh"], 2)
    source.write_bytes(write_fbx(takes=("walk", "run")))
    assert await job_process.list_takes(source, 9, HANG_TIMEOUT_S) == TakeList([], 0)
