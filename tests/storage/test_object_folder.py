"""Durability of objects in a folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.object_folder import COPY_CHUNK_BYTES, TEMPORARY_MARK, ObjectFolder
from bunraku.storage.object_storage import ObjectStorage
from tests.processes import find_program
from tests.time_limit import HANG_TIMEOUT_S

STORE_MOTION = """
import asyncio, sys
from pathlib import Path
from bunraku.ingest.persistence import store_motion
from bunraku.ingest.result import JobResult
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings

async def main() -> None:
    async with open_context(Settings(data=Path(sys.argv[1]))) as context:
        await context.catalogue.open()
        sys.stderr.flush()
        Path("/begin").exists()
        await store_motion(context, "m1", JobResult(b"motion", {}), {}, "aiko")
        Path("/answer").exists()
        await context.motion_store.remove("m1")

asyncio.run(main())
"""
"""Program that stores one motion; two look-ups of files mark the interval in a trace."""


def test_object_and_row_are_on_the_disk_before_the_answer(tmp_path: Path) -> None:
    trace, data = tmp_path / "trace", tmp_path / "data"
    calls = "trace=fsync,fdatasync,rename,renameat,renameat2,unlink,unlinkat,stat,newfstatat,statx,mkdir,mkdirat"
    command = [find_program("strace"), "-f", "-y", "-qq", "-o", str(trace), "-e", calls, sys.executable, "-c"]
    subprocess.run([*command, STORE_MOTION, str(data)], check=True, timeout=HANG_TIMEOUT_S)
    lines = trace.read_text().splitlines()
    begin = next(index for index, line in enumerate(lines) if '"/begin"' in line)
    end = next(index for index, line in enumerate(lines) if '"/answer"' in line)
    steps = [
        ("contents of the object", rf"fsync\(\d+<{data}/library/motions/m1\.bunraku{TEMPORARY_MARK}"),
        ("name of the object", rf"rename.*/motions/m1\.bunraku{TEMPORARY_MARK}.*/motions/m1\.bunraku\""),
        ("folder of the object", rf"fsync\(\d+<{data}/library/motions>"),
        ("journal of the row", rf"f(data)?sync\(\d+<{data}/catalogue\.sqlite-journal>"),
        ("row", rf"f(data)?sync\(\d+<{data}/catalogue\.sqlite>"),
        ("end of the transaction", rf"unlink.*{data}/catalogue\.sqlite-journal"),
        ("folder of the catalogue", rf"f(data)?sync\(\d+<{data}>"),
    ]
    position = begin
    for step, pattern in steps:
        found = [index for index in range(position, end) if re.search(pattern, lines[index])]
        assert found, f"{step} is not written after the previous step:\n" + "\n".join(lines[begin : end + 1])
        position = found[0] + 1
    # the entries of the created folders, one after the other
    created = [f"{data}/library>", f"{data}>", f"{tmp_path}>"]
    for folder in created:
        assert any(re.search(rf"fsync\(\d+<{folder}", line) for line in lines[:end]), folder


def test_new_contents_replace_the_old_only_when_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = ObjectFolder(tmp_path / "objects")
    folder.write("motions/a", b"old")

    def fail(_: int) -> None:
        raise OSError(5, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fail)
        with pytest.raises(OSError, match="Input/output"):
            folder.write("motions/a", b"new contents")
    assert folder.read("motions/a") == b"old"
    assert [entry.name for entry in (tmp_path / "objects" / "motions").iterdir()] == ["a"]
    folder.write("motions/a", b"new")
    assert folder.read("motions/a") == b"new"


def test_file_is_copied_without_having_it_in_memory(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(os.urandom(10 * COPY_CHUNK_BYTES))
    tracemalloc.start()
    try:
        ObjectFolder(tmp_path / "objects").write_file("sources/a", source)
        assert tracemalloc.get_traced_memory()[1] < 5 * COPY_CHUNK_BYTES
    finally:
        tracemalloc.stop()
    assert (tmp_path / "objects" / "sources" / "a").read_bytes() == source.read_bytes()


@pytest.mark.parametrize("path", ["", "/etc/passwd", "../a", "a/../b", "a//b", "a/.", "a\0"])
def test_path_outside_the_folder_is_rejected(tmp_path: Path, path: str) -> None:
    folder = ObjectFolder(tmp_path / "objects")
    for use in (folder.read, folder.remove, lambda one: folder.write(one, b"")):
        with pytest.raises(ValueError, match="invalid object path"):
            use(path)


def test_listing_has_sizes_of_all_files_and_no_folders(tmp_path: Path) -> None:
    folder = ObjectFolder(tmp_path / "objects")
    assert list(folder.list_chunks("logs")) == []
    for number in range(1_100):
        (tmp_path / "objects" / "logs").mkdir(exist_ok=True)
        (tmp_path / "objects" / "logs" / f"{number}").write_bytes(bytes(number % 7))
    (tmp_path / "objects" / "logs" / "folder").mkdir()
    chunks = list(folder.list_chunks("logs"))
    assert max(map(len, chunks)) <= 500
    listed = {one.path: one.bytes for chunk in chunks for one in chunk}
    assert listed == {f"logs/{number}": number % 7 for number in range(1_100)}
    assert folder.sizes(["logs/5", "logs/none"]) == [5, None]


async def test_folder_that_disappears_is_unavailable_and_not_created_again(tmp_path: Path) -> None:
    objects = ObjectStorage(f"file://{tmp_path}/objects")
    await objects.put("logs/a", b"a")
    (tmp_path / "objects").rename(tmp_path / "unmounted")
    for use in (objects.put("logs/b", b"b"), objects.put("notes/b", b"b"), objects.check()):
        with pytest.raises(BackendUnavailable):
            await use
    assert not (tmp_path / "objects").exists()
    (tmp_path / "unmounted").rename(tmp_path / "objects")
    await objects.put("notes/b", b"b")
    assert await objects.get("logs/a") == b"a"
