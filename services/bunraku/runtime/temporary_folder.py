"""Temporary folders that are removed even if their process is killed.

A folder has a lock file, which its process holds locked. When the process ends in any way, the lock is free, and the
next process that sweeps removes the folder.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full

LOCK_FILE = "owner"
"""Name of the lock file in a temporary folder."""
UNLOCKED_LIFETIME_S = 86_400.0
"""Age from which a folder without a lock file is removed, as older releases leave it, in seconds."""
_NAME_PATTERN = re.compile(r"bunraku-(upload|job|body|demo|workers)-[a-z0-9_]{8}")

Purpose = Literal["upload", "job", "body", "demo", "workers"]


@contextmanager
def temporary_folder(purpose: Purpose) -> Iterator[Path]:
    """Create a folder in the system's temporary folder and remove it with its contents at the end.

    Raise `ProblemError` (507) if there is no space for it, or `BackendUnavailable` if it cannot be created.
    """
    try:
        folder, lock = _create(purpose)
    except OSError as error:
        if is_disk_full(error):
            raise insufficient_storage("this server") from error
        raise BackendUnavailable("the temporary folder", str(error)) from error
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def sweep_temporary_folders() -> int:
    """Remove the temporary folders of processes that have ended, and return their number. It blocks."""
    removed = 0
    for folder in Path(tempfile.gettempdir()).glob("bunraku-*"):
        # other processes sweep at the same time
        with contextlib.suppress(OSError):
            removed += _NAME_PATTERN.fullmatch(folder.name) is not None and _remove_abandoned(folder)
    return removed


def try_lock(path: Path) -> int | None:
    """Create and lock a file; return its descriptor, or None if another process has locked it.

    The lock is released when the descriptor is closed or the process ends.
    """
    # imported here, as it exists only on POSIX
    import fcntl

    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _create(purpose: Purpose) -> tuple[Path, int]:
    """Return a new folder and the descriptor of its locked lock file."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=f"bunraku-{purpose}-"))
        try:
            lock = try_lock(folder / LOCK_FILE)
        except FileNotFoundError:
            continue
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        if lock is None:
            continue
        # another process may have swept the folder between its creation and its lock
        if os.fstat(lock).st_nlink:
            return folder, lock
        os.close(lock)


def _remove_abandoned(folder: Path) -> bool:
    status = folder.lstat()
    if folder.is_symlink() or not folder.is_dir() or status.st_uid != os.geteuid():
        return False
    if not (folder / LOCK_FILE).exists():
        if time.time() - status.st_mtime < UNLOCKED_LIFETIME_S:
            return False
        shutil.rmtree(folder)
        return True
    lock = try_lock(folder / LOCK_FILE)
    if lock is None:
        return False
    try:
        shutil.rmtree(folder)
    finally:
        os.close(lock)
    return True
