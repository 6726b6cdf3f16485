from __future__ import annotations

from pathlib import Path

import msgpack
import numpy as np
import pytest

from bunraku.motion.skeleton import standard_figure
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.performance_store import PerformanceHeader, PerformanceStore
from bunraku.storage.record import is_motion_id

HEADER = PerformanceHeader("session-1", "Aiko", 60.0, standard_figure(), 5, "aiko")


@pytest.fixture
def store(tmp_path: Path) -> PerformanceStore:
    return MotionStore.open(tmp_path.as_uri()).performances


async def test_performance_is_found_read_and_removed(store: PerformanceStore) -> None:
    assert await store.list_performances() == {}
    await store.put_header(HEADER)
    for part in ("a-0", "a-1", "b-0"):
        await store.put_part(HEADER.id, part, part.encode())
    await store.put_part("session-2", "c-0", b"")
    performances = await store.list_performances()
    assert set(performances) == {"session-1", "session-2"}
    assert performances[HEADER.id].modified > 1e9
    assert sorted(await store.load(HEADER.id, performances[HEADER.id])) == [b"a-0", b"a-1", b"b-0"]
    assert await store.get_header("session-2") is None
    await store.remove(HEADER.id, performances[HEADER.id])
    assert set(await store.list_performances()) == {"session-2"}
    assert await store.get_header(HEADER.id) is None


async def test_header_is_read_again(store: PerformanceStore) -> None:
    await store.put_header(HEADER)
    found = await store.get_header(HEADER.id)
    assert found is not None
    assert (found.id, found.name, found.fps, found.created_us, found.subject) == (HEADER.id, "Aiko", 60.0, 5, "aiko")
    assert np.array_equal(found.figure.offsets, HEADER.figure.offsets)
    assert np.array_equal(found.figure.tips, HEADER.figure.tips)
    assert is_motion_id(found.motion)
    assert found.motion == HEADER.motion != PerformanceHeader("session-2", "", 60.0, HEADER.figure, 5).motion


@pytest.mark.parametrize("performer", ["", "../session-1", "a/b", "x" * 65, "a.b"])
async def test_text_that_cannot_be_an_id_names_no_performance(store: PerformanceStore, performer: str) -> None:
    assert await store.get_header(performer) is None


@pytest.mark.parametrize("data", [b"", b"\xc1", msgpack.packb([1]), msgpack.packb(["a", "b", 60.0, 5, "", b"1", b"2"])])
def test_damaged_header_is_rejected(data: bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011
        PerformanceHeader.unpack(data)
