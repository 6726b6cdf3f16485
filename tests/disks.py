"""Small and full file systems for tests."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest


@contextmanager
def mount_small_disk(folder: Path, options: str = "size=1m") -> Iterator[Path]:
    """Mount a file system in memory at a new folder. Skip the test if that is not permitted."""
    folder.mkdir(parents=True)
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True).returncode != 0:
        pytest.skip("only root can mount a small file system")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def fill_disk(folder: Path) -> Path:
    """Fill the file system of a folder to the last block, and return the file that does."""
    filler = folder / "filler"
    with filler.open("wb", buffering=0) as file:
        for size in (65_536, 4_096, 1):
            with suppress(OSError):
                while True:
                    file.write(bytes(size))
    assert os.statvfs(folder).f_bavail == 0
    return filler


def use_up_inodes(folder: Path) -> list[Path]:
    """Create files until the file system of a folder has no free inode, and return them."""
    count = os.statvfs(folder).f_ffree
    files = [folder / f"inode-{number}" for number in range(count)]
    for path in files:
        path.touch()
    assert os.statvfs(folder).f_ffree == 0
    return files
