from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.storage import motion_store
from bunraku.storage.motion_store import MAX_CACHE_IDLE_US, MotionStore
from bunraku.storage.object_storage import ObjectStorage
from bunraku.wire.messages import Data, Description, unpack
from tests.vectors.blocks import random_motion

ENCODED = encode_motion(random_motion(2.5, 30.0, 8), error_bounds_mm=(30.0, 5.0), grade="live")


async def test_stored_motion_has_packets_ready_to_send(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}/library")
    await store.put("m1", pack_motion("m1", ENCODED))
    stored = await store.get("m1")
    assert stored is not None
    description = unpack(stored.description)
    assert isinstance(description, Description)
    assert description.tracks[0]["rates"][1]["mean"] == round(ENCODED.ladder[1].mean_error_mm, 3)
    for rate, packets in enumerate(stored.first_packets):
        for index, packet in enumerate(packets):
            data = unpack(packet)
            assert isinstance(data, Data)
            assert (data.rate, data.index) == (rate, index)
            assert decode_motion_block(stored.first_track, data.block).frames == stored.first_track.frames_in(index)


async def test_log_exists_until_it_is_removed(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put_log("a-log_1", b"what was done")
    assert await MotionStore.open(f"file://{tmp_path}").get_log("a-log_1") == b"what was done"
    assert (tmp_path / "logs" / "a-log_1").is_file()
    await store.remove_log("a-log_1")
    await store.remove_log("a-log_1")
    assert await store.get_log("a-log_1") is None


@pytest.mark.parametrize("name", ["", "../m1", "a/b", "a b", "é", "a" * 65])
async def test_invalid_log_name_is_never_used_as_a_path(tmp_path: Path, name: str) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    with pytest.raises(ValueError, match="invalid log name"):
        await store.put_log(name, b"")
    assert await store.get_log(name) is None
    await store.remove_log(name)


async def test_motion_can_be_removed_twice(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put("m1", pack_motion("m1", ENCODED))
    await store.get("m1")
    await store.remove("m1")
    await store.remove("m1")
    assert await store.get("m1") is None
    assert await MotionStore.open(f"file://{tmp_path}").get("m1") is None


async def test_cache_is_bounded_and_evicted_motions_are_reloaded(monkeypatch: pytest.MonkeyPatch) -> None:
    store = MotionStore.open("memory:///")
    packed = pack_motion("m", ENCODED)
    monkeypatch.setattr(motion_store, "MAX_CACHE_BYTES", 2 * len(packed))
    for number in range(5):
        await store.put(f"m{number}", packed)
        assert await store.get(f"m{number}") is not None
    cached = store._cache
    assert list(cached) == ["m3", "m4"] or list(cached) == ["m2", "m3", "m4"]
    assert await store.get("m0") is not None
    assert store._cached_bytes == sum(stored.total_bytes for stored, _ in cached.values())


async def test_motion_without_requests_leaves_the_cache() -> None:
    now_us = 0
    store = MotionStore(ObjectStorage("memory:///"), lambda: now_us)
    for name in ("idle", "requested", "new"):
        await store.put(name, pack_motion(name, ENCODED))
    await store.get("idle")
    await store.get("requested")
    now_us = 1
    await store.get("requested")
    now_us = MAX_CACHE_IDLE_US
    await store.get("new")
    assert list(store._cache) == ["idle", "requested", "new"]
    now_us = MAX_CACHE_IDLE_US + 1
    await store.get("new")
    assert list(store._cache) == ["requested", "new"]
    assert store._cached_bytes == sum(stored.total_bytes for stored, _ in store._cache.values())


async def test_motion_in_use_is_loaded_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_store, "MAX_CACHE_BYTES", 1)
    store = MotionStore.open("memory:///")
    for name in ("m1", "m2"):
        await store.put(name, pack_motion(name, ENCODED))
    first, second = await asyncio.gather(store.get("m1"), store.get("m1"))
    assert first is second is not None
    await store.get("m2")
    assert list(store._cache) == ["m2"]
    assert await store.get("m1") is first


async def test_motion_of_another_codec_is_none_until_replaced(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put("m1", pack_motion("m1", ENCODED).replace(b"bunraku.motion/2", b"bunraku.motion/1"))
    assert await store.get("m1") is None
    await store.put("m1", pack_motion("m1", ENCODED))
    assert await store.get("m1") is not None


@pytest.mark.parametrize("motion", ["", "../m1", "a/b", "a//b", "m1\0", "é", ".", "motions/m1", "a" * 7_000])
async def test_malformed_id_is_not_found(tmp_path: Path, motion: str) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put("m1", pack_motion("m1", ENCODED))
    assert await store.get(motion) is None
