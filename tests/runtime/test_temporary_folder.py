from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from bunraku.runtime import temporary_folder as module
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.temporary_folder import sweep_temporary_folders, temporary_folder, try_lock
from tests.disks import fill_disk, mount_small_disk

HOLD_FOLDERS = """
import sys
from bunraku.runtime.temporary_folder import temporary_folder
with temporary_folder("upload") as upload, temporary_folder("job") as job:
    (upload / "source").write_bytes(b"file")
    (job / "deep" / "folder").mkdir(parents=True)
    print(upload, job, flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def parent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder in which temporary folders are created."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def hold_folders() -> tuple[subprocess.Popen[str], set[Path]]:
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD_FOLDERS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, {Path(word) for word in process.stdout.readline().split()}


def kill(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def test_folder_is_removed_at_the_end(parent: Path) -> None:
    with temporary_folder("demo") as folder:
        (folder / "file").touch()
        assert folder.parent == parent
        assert sweep_temporary_folders() == 0
        assert (folder / "file").exists()
    assert list(parent.iterdir()) == []


def test_folders_of_killed_processes_are_swept_and_those_of_others_stay(parent: Path) -> None:
    alive, kept = hold_folders()
    for _ in range(3):
        process, folders = hold_folders()
        assert all(folder.is_dir() for folder in folders)
        kill(process)
        assert all(folder.is_dir() for folder in folders)
    assert sweep_temporary_folders() == 6
    assert set(parent.iterdir()) == kept
    alive.communicate("")
    assert list(parent.iterdir()) == []


def test_foreign_files_are_not_swept(parent: Path, tmp_path: Path) -> None:
    target = tmp_path / "elsewhere"
    target.mkdir()
    (target / module.LOCK_FILE).touch()
    (parent / "bunraku-upload-abcdefgh").symlink_to(target)
    (parent / "bunraku-job-abcdefgh").touch()
    (parent / "bunraku-data").mkdir()
    (parent / "bunraku-data" / module.LOCK_FILE).touch()
    (parent / "bunraku-upload-recently").mkdir()
    (parent / "bunraku-upload-01234567").mkdir()
    assert sweep_temporary_folders() == 0
    old = time.time() - module.UNLOCKED_LIFETIME_S - 1
    for name in ("bunraku-data", "bunraku-upload-01234567"):
        os.utime(parent / name, (old, old))
    assert sweep_temporary_folders() == 1
    assert not (parent / "bunraku-upload-01234567").exists()
    assert (parent / "bunraku-data").exists()
    assert (target / module.LOCK_FILE).exists()


def test_folder_swept_before_it_is_locked_is_created_again(parent: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    attempts: list[Path] = []

    def lock_late(path: Path) -> int | None:
        attempts.append(path)
        lock = try_lock(path)
        if len(attempts) == 1:
            # a sweep between the creation of the lock file and its lock
            path.unlink()
            path.parent.rmdir()
        return lock

    monkeypatch.setattr(module, "try_lock", lock_late)
    with temporary_folder("job") as folder:
        assert len(attempts) == 2
        assert list(parent.iterdir()) == [folder]


def test_full_disk_is_a_507(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with mount_small_disk(tmp_path / "disk", "size=1m,nr_inodes=10") as disk:
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        fill_disk(disk)
        for number in range(os.statvfs(disk).f_ffree):
            (disk / str(number)).touch()
        with pytest.raises(ProblemError) as raised, temporary_folder("upload"):
            pass
        assert raised.value.status == 507


def test_missing_temporary_folder_is_unavailable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(BackendUnavailable, match="temporary folder"), temporary_folder("upload"):
        pass
    assert sweep_temporary_folders() == 0
