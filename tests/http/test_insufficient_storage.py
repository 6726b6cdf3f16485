"""Uploads and writes to a full file system: the response, and the integrity of stored data."""

from __future__ import annotations

import errno
import hashlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from bunraku.http.problem_details import ProblemError, insufficient_storage, is_disk_full, translate_disk_full
from bunraku.storage.object_storage import ObjectStorage
from tests.servers import make_bvh_clip, run_server


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """Folder on a file system of one megabyte."""
    folder = tmp_path / "small"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode != 0:
        pytest.skip("mounting a small file system needs root")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


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


async def test_failed_write_keeps_the_stored_objects(small: Path) -> None:
    objects = ObjectStorage(f"file://{small}")
    await objects.put("a/first", b"x" * 400_000)
    for name in ("a/first", "a/second"):
        with pytest.raises(ProblemError) as raised:
            await objects.put(name, b"y" * 900_000)
        assert raised.value.status == 507
    assert await objects.get("a/first") == b"x" * 400_000
    assert await objects.get("a/second") is None
    assert file_names(small) == ["first"]
    await objects.put("a/second", b"y" * 400_000)


async def test_upload_to_full_disk_fails_and_keeps_stored_motions(small: Path, tmp_path: Path) -> None:
    with run_server(tmp_path / "data", library=f"file://{small}") as url:
        async with httpx2.AsyncClient(base_url=url, timeout=60.0) as http:
            stored = await http.post("/v1/motions", params={"filename": "a.bvh"}, content=make_bvh_clip(1.0, 1))
            assert stored.status_code == 201
            filler = small / "filler"
            with pytest.raises(OSError, match="No space"):
                filler.write_bytes(bytes(2 << 20))
            rejected = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert rejected.status_code == 507
            assert rejected.headers["content-type"] == "application/problem+json"
            assert [one["id"] for one in (await http.get("/v1/motions")).json()["items"]] == [stored.json()["id"]]
            before = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert before.status_code == 200
            digest = hashlib.sha256(before.content).digest()
            filler.unlink()
            accepted = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert accepted.status_code == 201
            unchanged = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert hashlib.sha256(unchanged.content).digest() == digest
