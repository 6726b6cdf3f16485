"""A folder with no room left: what is answered, and what is left of what was there."""

from __future__ import annotations

import errno
import hashlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full, translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.storage.object_storage import ObjectStorage
from tests.servers import make_bvh_clip, run_server


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """A folder that has room for a megabyte."""
    folder = tmp_path / "small"
    folder.mkdir()
    asked = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(asked, capture_output=True).returncode != 0:
        pytest.skip("only root can make a small file system")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def file_names(folder: Path) -> list[str]:
    return [file.name for file in folder.rglob("*") if file.is_file()]


def test_what_the_system_says_of_a_full_disk_is_a_507() -> None:
    with pytest.raises(ProblemError) as told, translate_disk_full("this server"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert told.value.status == 507
    assert "this server" in told.value.detail
    with pytest.raises(PermissionError), translate_disk_full("this server"):
        raise PermissionError(errno.EACCES, "no")
    assert not is_disk_full(ValueError("os error 2)"))
    assert insufficient_storage("the library").extra["hint"]


async def test_an_object_that_has_no_room_leaves_what_was_there(small: Path) -> None:
    objects = ObjectStorage(f"file://{small}")
    await objects.put("a/kept", b"x" * 400_000)
    for name in ("a/kept", "a/other"):
        with pytest.raises(ProblemError) as told:
            await objects.put(name, b"y" * 900_000)
        assert told.value.status == 507
    assert await objects.get("a/kept") == b"x" * 400_000
    assert await objects.get("a/other") is None
    assert file_names(small) == ["kept"]
    await objects.put("a/other", b"y" * 400_000)


async def test_an_upload_without_room_is_refused_and_what_was_acknowledged_is_whole(
    small: Path, tmp_path: Path
) -> None:
    with run_server(tmp_path / "data", library=f"file://{small}") as url:
        async with httpx2.AsyncClient(base_url=url, timeout=60.0) as http:
            kept = await http.post("/v1/motions", params={"filename": "a.bvh"}, content=make_bvh_clip(1.0, 1))
            assert kept.status_code == 201
            filler = small / "filler"
            with pytest.raises(OSError, match="No space"):
                filler.write_bytes(bytes(2 << 20))
            refused = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert refused.status_code == 507
            assert refused.headers["content-type"] == "application/problem+json"
            assert [one["id"] for one in (await http.get("/v1/motions")).json()["items"]] == [kept.json()["id"]]
            again = await http.get(f"/v1/motions/{kept.json()['id']}/blocks/0/0")
            assert again.status_code == 200
            digest = hashlib.sha256(again.content).digest()
            filler.unlink()
            taken = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert taken.status_code == 201
            still = await http.get(f"/v1/motions/{kept.json()['id']}/blocks/0/0")
            assert hashlib.sha256(still.content).digest() == digest
