from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from bunraku.ingest.audio import create_audio_job
from bunraku.ingest.motion import MotionOperation, create_motion_job
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.source_file import SourceFile
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.motion_id import derive_motion_id
from tests.servers import make_bvh_clip


def test_motion_id_is_derived_from_the_digest() -> None:
    motion_id = derive_motion_id(hashlib.sha256(b"1").digest())
    assert len(motion_id) == 20
    assert set(motion_id) <= set("abcdefghijklmnopqrstuvwxyz234567")
    assert motion_id != derive_motion_id(hashlib.sha256(b"2").digest())


async def test_motion_is_stored_only_if_its_file_is_valid(tmp_path: Path) -> None:
    source = tmp_path / "source"
    async with open_context(Settings(data=tmp_path / "data")) as context:
        operation = MotionOperation(context, WorkerSlots())
        source.write_bytes(b"not a motion")
        with pytest.raises(ProblemError) as raised:
            await operation.ingest_file("m1", SourceFile(source, "x.bvh"))
        assert raised.value.status == 422
        assert await context.catalogue.get_motion("m1") is None
        assert await context.motion_store.get("m1") is None
        source.write_bytes(make_bvh_clip(0.4))
        entry, is_new = await operation.ingest_file("m1", SourceFile(source, "../odd/na\x00me.bvh"))
        assert is_new
        assert "/" not in entry.description["name"]
        assert await context.motion_store.get("m1") is not None
        assert (await operation.ingest_file("m1", SourceFile(source, "x.bvh"))) == (entry, False)


async def test_resumed_job_keeps_its_subject(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(0.4))
    async with open_context(Settings(data=tmp_path / "data")) as context:
        operation = MotionOperation(context, WorkerSlots())
        details = {"motion": "m1", "filename": "a.bvh", "subject": "aiko"}
        await operation.run_job(details, source, UploadProgress())
        entry = await context.catalogue.get_motion("m1")
        assert entry is not None
        assert entry.subject == "aiko"
        assert entry.bytes > 0


def test_jobs_of_subjects_with_the_same_file_are_separate() -> None:
    digest = bytes(32)
    jobs = [create_motion_job(digest, "a.bvh", subject) for subject in ("aiko", "ben", "aiko")]
    jobs += [create_audio_job("m1", digest, "a.wav", subject) for subject in ("aiko", "ben", "aiko")]
    assert len({job.id for job in jobs}) == 4
    assert jobs[0].id == jobs[2].id
    assert jobs[3].id == jobs[5].id
    assert jobs[0].details["motion"] == jobs[1].details["motion"]
