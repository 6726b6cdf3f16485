from __future__ import annotations

import gzip
import hashlib
from pathlib import Path

import pytest

from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.props.operation import PropFit, PropOperation, create_prop_job, prop_json
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.props.placing import Grip
from bunraku.runtime.context import open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.wire.prop import is_stored_prop
from tests.props.samples import box_glb

AS_IN_FILE = PropFit()
DIGEST = hashlib.sha256(b"1").digest()


def test_id_depends_on_the_file_and_the_fit_alone() -> None:
    job = create_prop_job(DIGEST, "a.glb", "aiko", AS_IN_FILE)
    assert is_stored_prop(job.details["prop"])
    assert create_prop_job(DIGEST, "b.glb", "ben", AS_IN_FILE).details["prop"] == job.details["prop"]
    others = [PropFit(0.5), PropFit(None, Grip.MIDDLE), PropFit(0.5, Grip.MIDDLE)]
    assert len({job.details["prop"], *(create_prop_job(DIGEST, "a", "", fit).details["prop"] for fit in others)}) == 4


async def test_prop_is_made_once_and_cleaned(tmp_path: Path) -> None:
    path = tmp_path / "source"
    path.write_bytes(box_glb())
    async with open_context(Settings(data=tmp_path / "data")) as context:
        operation = PropOperation(context, WorkerSlots())
        job = create_prop_job(DIGEST, "../a\x00 sword\u202e.glb", "aiko", AS_IN_FILE)
        prop, is_new = await operation.make(AS_IN_FILE, job, path, UploadProgress())
        assert is_new
        assert prop.description["name"].isprintable()
        assert "sword" in prop.description["name"]
        path.write_bytes(b"not read again")
        assert await operation.make(AS_IN_FILE, job, path, UploadProgress()) == (prop, False)
        described = prop_json(prop)
        assert list(described)[:4] == ["id", "created", "name", "filename"]
        model = await context.catalogue.get_prop_model(prop.id)
        assert model is not None
        assert len(model) == described["bytes"]
        assert gzip.decompress(model).startswith(b"glTF")


async def test_nothing_is_stored_of_a_file_that_is_refused_or_beyond_a_quota(tmp_path: Path) -> None:
    path = tmp_path / "source"
    settings = Settings(data=tmp_path / "data", total_props=1)
    async with open_context(settings) as context:
        operation = PropOperation(context, WorkerSlots())

        async def make(content: bytes) -> None:
            path.write_bytes(content)
            job = create_prop_job(hashlib.sha256(content).digest(), "a.glb", "", AS_IN_FILE)
            await operation.make(AS_IN_FILE, job, path, UploadProgress())

        with pytest.raises(ProblemError) as refused:
            await make(b"not a model")
        assert (refused.value.status, refused.value.extra["filename"]) == (422, "a.glb")
        await operation.rules.check_quota("")
        await make(box_glb())
        with pytest.raises(ProblemError) as beyond:
            await make(box_glb(0.1))
        assert (beyond.value.status, beyond.value.title) == (403, "Quota used up")
        with pytest.raises(ProblemError):
            await operation.rules.check_quota("")
        assert len((await context.catalogue.list_props(10))[0]) == 1
