"""Objects as files of a folder, written so that a stored object survives a power loss."""

from __future__ import annotations

import contextlib
import io
import os
import secrets
import shutil
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

TEMPORARY_MARK = "#"
"""Character in the names of files that are being written; no object has it in its name."""
LIST_CHUNK = 500
"""Number of objects in one chunk of a listing."""

COPY_CHUNK_BYTES = 1 << 20


class StoredObject(NamedTuple):
    """An object as a listing shows it."""

    path: str
    bytes: int
    modified: float
    """Time of the last change, seconds since 1970."""


class ObjectFolder:
    """Objects by path in a folder. All methods block: call them in threads.

    Methods raise OSError. `root` itself is created only by the constructor: a file system that is unmounted later is an
    error, not an empty folder.
    """

    def __init__(self, root: Path) -> None:
        self._root = root
        self._durable_folders: set[Path] = set()
        with contextlib.suppress(OSError):
            # if it fails, so do the methods
            make_durable_folder(root)

    def __str__(self) -> str:
        return f"the folder {self._root}"

    def write(self, path: str, data: bytes) -> None:
        """Store an object durably; the previous object of this path stays until then."""
        self._write(path, io.BytesIO(data))

    def write_file(self, path: str, source: Path) -> None:
        """Store the contents of a file as `write` does, without having all of it in memory."""
        with source.open("rb") as contents:
            self._write(path, contents)

    def _write(self, path: str, contents: BinaryIO) -> None:
        """Store an object durably.

        The order is that of a write that survives a power loss at any point: contents to the disk, name of the
        temporary file to the final name, folder to the disk.
        """
        target = self._resolve(path)
        self._prepare_folder(target.parent)
        temporary = target.with_name(f"{target.name}{TEMPORARY_MARK}{secrets.token_hex(8)}")
        try:
            with temporary.open("xb") as file:
                shutil.copyfileobj(contents, file, COPY_CHUNK_BYTES)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        sync_folder(target.parent)

    def read(self, path: str) -> bytes | None:
        """Return an object, None if it does not exist."""
        try:
            return self._resolve(path).read_bytes()
        except FileNotFoundError:
            return None

    def copy(self, path: str, target: Path) -> bool:
        """Write an object to the file `target`; return whether the object exists."""
        try:
            contents = self._resolve(path).open("rb")
        except FileNotFoundError:
            return False
        with contents, target.open("wb") as file:
            shutil.copyfileobj(contents, file, COPY_CHUNK_BYTES)
        return True

    def remove(self, path: str) -> None:
        """Remove an object if it exists. After a power loss it may exist again, as an object without a row."""
        self._resolve(path).unlink(missing_ok=True)

    def sizes(self, paths: list[str]) -> list[int | None]:
        """Return the sizes of objects in bytes, None for those that do not exist."""
        found: list[int | None] = []
        for path in paths:
            try:
                found.append(self._resolve(path).stat().st_size)
            except FileNotFoundError:
                found.append(None)
        return found

    def list_chunks(self, prefix: str) -> Iterator[list[StoredObject]]:
        """Yield all files of the subfolder `prefix` in chunks, those of unfinished writes included."""
        try:
            entries = os.scandir(self._root / prefix)
        except FileNotFoundError:
            return
        with entries:
            while chunk := list(islice(entries, LIST_CHUNK)):
                objects = []
                for entry in chunk:
                    # an object may be removed meanwhile
                    with contextlib.suppress(FileNotFoundError):
                        if entry.is_file(follow_symlinks=False):
                            status = entry.stat(follow_symlinks=False)
                            objects.append(StoredObject(f"{prefix}/{entry.name}", status.st_size, status.st_mtime))
                yield objects

    def is_usable(self) -> bool:
        """Return whether the folder exists, and can be read and written."""
        return os.access(self._root, os.R_OK | os.W_OK | os.X_OK)

    def _resolve(self, path: str) -> Path:
        if not path or any(part in ("", ".", "..") for part in path.split("/")) or "\0" in path:
            raise ValueError(f"invalid object path {path[:80]!r}")
        return self._root / path

    def _prepare_folder(self, folder: Path) -> None:
        """Create a folder below the root, and its entry on the disk."""
        if folder in self._durable_folders:
            return
        if folder != self._root:
            self._prepare_folder(folder.parent)
            folder.mkdir(exist_ok=True)
            # another process may have created it and not yet synchronised its entry
            sync_folder(folder.parent)
        self._durable_folders.add(folder)


def make_durable_folder(folder: Path) -> None:
    """Create a folder and its missing parents, with their entries on the disk."""
    if folder.is_dir():
        return
    make_durable_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    sync_folder(folder.parent)


def sync_folder(folder: Path) -> None:
    """Write the entries of a folder to the disk, where the file system supports it."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
