"""Space set aside on a disk, so that rows can be removed when it is full."""

from __future__ import annotations

import os
from pathlib import Path

from bunraku.runtime.insufficient_storage import is_disk_full

RESERVE_BYTES = 4 << 20
"""Size of the reserve on a disk with enough free space."""
MAX_SHARE_OF_FREE_SPACE = 8
"""A new reserve takes at most this fraction (1/n) of the free space."""
MIN_RESERVE_BYTES = 64 << 10
"""Smallest useful reserve: SQLite's journal of one removal needs about 30 kB."""
_CHUNK_BYTES = 64 << 10


class SpaceReserve:
    """A file that occupies blocks of the disk until they are needed. All methods block: call them in threads."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._released_bytes = 0

    def restore(self) -> bool:
        """Create the file, or a larger one if there is space by now. Return whether the file exists.

        After `release` it takes back the space that is still free, at most its former size.
        """
        present = self._size()
        try:
            status = os.statvfs(self._path.parent)
        except OSError:
            return False
        free = status.f_bavail * status.f_frsize
        target = max(self._released_bytes, min(RESERVE_BYTES, (present + free) // MAX_SHARE_OF_FREE_SPACE))
        if present >= target or target < MIN_RESERVE_BYTES:
            return present > 0
        try:
            self._write(target)
        except OSError:
            # a read-only folder, or one that does not exist: then there is nothing to remove either
            return self._size() > 0
        self._released_bytes = 0
        return True

    def release(self) -> bool:
        """Remove the file and return whether it existed."""
        size = self._size()
        try:
            self._path.unlink()
        except OSError:
            return False
        self._released_bytes = size
        return size > 0

    def is_disk_full(self) -> bool:
        """Return whether the disk has no free block or no free inode."""
        try:
            status = os.statvfs(self._path.parent)
        except OSError:
            return False
        return status.f_bavail == 0 or (status.f_files > 0 and status.f_favail == 0)

    def _size(self) -> int:
        try:
            return self._path.stat().st_size
        except OSError:
            return 0

    def _write(self, target: int) -> None:
        """Write up to `target` bytes; on a full disk keep what fits."""
        with self._path.open("wb", buffering=0) as file:
            try:
                for _ in range(0, target, _CHUNK_BYTES):
                    # random, as some file systems store zeros without blocks
                    file.write(os.urandom(_CHUNK_BYTES))
            except OSError as error:
                if not is_disk_full(error):
                    raise
            os.fsync(file.fileno())
