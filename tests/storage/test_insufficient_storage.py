"""Object store and server on a full disk."""

from __future__ import annotations

import errno
import hashlib
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full, translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.storage.object_storage import ObjectStorage
from tests.disks import mount_small_disk
from tests.servers import make_bvh_clip, run_server


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """Return a folder with 1 MiB of space."""
    with mount_small_disk(tmp_path / "small") as folder:
        yield folder


def file_names(folder: Path) -> list[str]:
    return [file.name for file in folder.rglob("*") if file.is_file()]


def test_disk_full_error_becomes_a_507() -> None:
    with pytest.raises(ProblemError) as raised, translate_disk_full("this server"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert raised.value.status == 507
    assert "this server" in raised.value.detail
    with pytest.raises(PermissionError), translate_disk_full("this server"):
        raise PermissionError(errno.EACCES, "no")
    assert not is_disk_full(ValueError("os error 2)"))
    assert insufficient_storage("the library").extra["hint"]


async def test_failed_put_keeps_the_previous_object(small: Path) -> None:
    objects = ObjectStorage(f"file://{small}")
    await objects.put("a/kept", b"x" * 400_000)
    for name in ("a/kept", "a/other"):
        with pytest.raises(ProblemError) as raised:
            await objects.put(name, b"y" * 900_000)
        assert raised.value.status == 507
    assert await objects.get("a/kept") == b"x" * 400_000
    assert await objects.get("a/other") is None
    assert file_names(small) == ["kept"]
    await objects.put("a/other", b"y" * 400_000)


async def test_upload_to_a_full_disk_leaves_stored_motions_intact(small: Path, tmp_path: Path) -> None:
    with run_server(tmp_path / "data", library=f"file://{small}") as url:
        async with httpx2.AsyncClient(base_url=url, timeout=60.0) as http:
            stored = await http.post("/v1/motions", params={"filename": "a.bvh"}, content=make_bvh_clip(1.0, 1))
            assert stored.status_code == 201
            filler = small / "filler"
            with pytest.raises(OSError, match="No space"):
                filler.write_bytes(bytes(2 << 20))
            refused = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert refused.status_code == 507
            assert refused.headers["content-type"] == "application/problem+json"
            assert [item["id"] for item in (await http.get("/v1/motions")).json()["items"]] == [stored.json()["id"]]
            before = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert before.status_code == 200
            digest = hashlib.sha256(before.content).digest()
            filler.unlink()
            retried = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert retried.status_code == 201
            after = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert hashlib.sha256(after.content).digest() == digest
