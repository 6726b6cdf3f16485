"""Removal of rows and motions on a full disk."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from bunraku.runtime.problem import ProblemError
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.record import CatalogueEntry, Job, Share, ShareScope
from bunraku.storage.removal import remove_motion
from bunraku.storage.space_reserve import MIN_RESERVE_BYTES, RESERVE_BYTES, SpaceReserve
from tests.disks import fill_disk, mount_small_disk, use_up_inodes


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """Return a folder with 4 MiB of space and few inodes."""
    with mount_small_disk(tmp_path / "disk", "size=4m,nr_inodes=40") as folder:
        yield folder


def share(number: int) -> Share:
    return Share(f"{number:018x}", 1, 4_000_000_000, "aiko", "s1")


def allocated_bytes(path: Path) -> int:
    return path.stat().st_blocks * 512


async def open_with_shares(disk: Path, count: int) -> Catalogue:
    catalogue = Catalogue(f"sqlite:///{disk}/catalogue.sqlite")
    for number in range(count):
        await catalogue.add_share(share(number))
    return catalogue


async def test_links_can_be_removed_again_and_again_on_a_full_disk(disk: Path) -> None:
    catalogue = await open_with_shares(disk, 20)
    reserve = disk / "catalogue.sqlite-reserve"
    assert allocated_bytes(reserve) >= MIN_RESERVE_BYTES
    fill_disk(disk)
    with pytest.raises(ProblemError) as raised:
        await catalogue.add_share(share(99))
    assert raised.value.status == 507
    for number in range(20):
        assert await catalogue.remove_share(share(number).id)
        # nobody else can use the space meanwhile
        assert allocated_bytes(reserve) >= MIN_RESERVE_BYTES
    assert await catalogue.list_shares(ShareScope(), 50) == []
    await catalogue.close()
    reopened = Catalogue(f"sqlite:///{disk}/catalogue.sqlite")
    assert await reopened.list_shares(ShareScope(), 50) == []
    await reopened.close()


async def test_rows_can_be_removed_without_a_free_inode(disk: Path) -> None:
    catalogue = await open_with_shares(disk, 1)
    await catalogue.add_motion(CatalogueEntry("m1", 1, {}))
    await catalogue.add_job(Job("j1", 1, {}), "a", 2)
    use_up_inodes(disk)
    with pytest.raises(ProblemError) as raised:
        await catalogue.add_share(share(99))
    assert raised.value.status == 507
    assert await catalogue.remove_share(share(0).id)
    assert await catalogue.remove_motion("m1")
    await catalogue.remove_job("j1")
    assert await catalogue.find_jobs(["j1"]) == set()
    await catalogue.close()


async def test_motion_is_removed_from_a_disk_that_was_full_at_the_start(disk: Path) -> None:
    motion_store = MotionStore.open(f"file://{disk}/library")
    catalogue = await open_with_shares(disk, 0)
    await motion_store.put("m1", bytes(500_000))
    await catalogue.add_motion(CatalogueEntry("m1", 1, {}))
    await catalogue.close()
    (disk / "catalogue.sqlite-reserve").unlink()
    filler = fill_disk(disk)
    restarted = Catalogue(f"sqlite:///{disk}/catalogue.sqlite")
    with pytest.raises(ProblemError):
        await restarted.remove_motion("m1")
    assert await remove_motion(restarted, motion_store, "m1")
    assert await restarted.get_motion("m1") is None
    assert await motion_store.object_sizes(["m1"]) == [None]
    assert not await remove_motion(restarted, motion_store, "m1")
    await asyncio.to_thread(filler.unlink)
    await restarted.restore_reserve()
    assert allocated_bytes(disk / "catalogue.sqlite-reserve") >= MIN_RESERVE_BYTES
    await restarted.close()


def test_reserve_takes_a_small_part_of_the_free_space(disk: Path) -> None:
    path = disk / "reserve"
    reserve = SpaceReserve(path)
    assert reserve.restore()
    assert MIN_RESERVE_BYTES <= allocated_bytes(path) <= (4 << 20) // 8
    size = path.stat().st_size
    fill_disk(disk)
    assert reserve.release()
    assert not reserve.release()
    assert os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize >= size
    assert reserve.restore()
    assert path.stat().st_size == size
    assert os.statvfs(disk).f_bavail == 0


def test_reserve_occupies_blocks_of_a_large_disk(tmp_path: Path) -> None:
    path = tmp_path / "reserve"
    assert SpaceReserve(path).restore()
    assert allocated_bytes(path) >= RESERVE_BYTES


def test_reserve_of_a_missing_folder_is_left_out(tmp_path: Path) -> None:
    reserve = SpaceReserve(tmp_path / "missing" / "reserve")
    assert not reserve.restore()
    assert not reserve.release()
    assert not reserve.is_disk_full()
