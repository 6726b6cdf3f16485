from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.storage import motion_store
from bunraku.storage.motion_store import MotionStore
from bunraku.wire.messages import Data, Description, unpack
from tests.vectors.blocks import random_motion

ENCODED = encode_motion(random_motion(2.5, 30.0, 8), error_bounds_mm=(30.0, 5.0), grade="live")


async def test_a_motion_comes_back_ready_to_be_sent(tmp_path: Path) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}/library")
    await shelf.put("m1", pack_motion("m1", ENCODED))
    stored = await shelf.get("m1")
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


async def test_a_log_is_kept_until_it_is_removed(tmp_path: Path) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}")
    await shelf.put_log("a-log_1", b"what was done")
    assert await MotionStore.open(f"file://{tmp_path}").get_log("a-log_1") == b"what was done"
    assert (tmp_path / "logs" / "a-log_1").is_file()
    await shelf.remove_log("a-log_1")
    await shelf.remove_log("a-log_1")
    assert await shelf.get_log("a-log_1") is None


@pytest.mark.parametrize("name", ["", "../m1", "a/b", "a b", "é", "a" * 65])
async def test_what_could_not_be_a_logs_name_is_never_a_path(tmp_path: Path, name: str) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}")
    with pytest.raises(ValueError, match="log's name"):
        await shelf.put_log(name, b"")
    assert await shelf.get_log(name) is None
    await shelf.remove_log(name)


async def test_what_was_removed_is_gone_and_removing_it_again_is_nothing(tmp_path: Path) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}")
    await shelf.put("m1", pack_motion("m1", ENCODED))
    await shelf.get("m1")
    await shelf.remove("m1")
    await shelf.remove("m1")
    assert await shelf.get("m1") is None
    assert await MotionStore.open(f"file://{tmp_path}").get("m1") is None


async def test_memory_is_bounded_and_what_fell_out_is_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    shelf = MotionStore.open("memory:///")
    packed = pack_motion("m", ENCODED)
    monkeypatch.setattr(motion_store, "MAX_CACHE_BYTES", 2 * len(packed))
    for number in range(5):
        await shelf.put(f"m{number}", packed)
        assert await shelf.get(f"m{number}") is not None
    kept = shelf._cache
    assert list(kept) == ["m3", "m4"] or list(kept) == ["m2", "m3", "m4"]
    assert await shelf.get("m0") is not None
    assert shelf._cached_bytes == sum(stored.total_bytes for stored in kept.values())


async def test_a_motion_of_another_codec_is_none_until_it_is_sent_again(tmp_path: Path) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}")
    await shelf.put("m1", pack_motion("m1", ENCODED).replace(b"bunraku.motion/2", b"bunraku.motion/1"))
    assert await shelf.get("m1") is None
    await shelf.put("m1", pack_motion("m1", ENCODED))
    assert await shelf.get("m1") is not None


@pytest.mark.parametrize("motion", ["", "../m1", "a/b", "a//b", "m1\0", "é", ".", "motions/m1"])
async def test_what_could_not_be_an_id_is_no_motion(tmp_path: Path, motion: str) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}")
    await shelf.put("m1", pack_motion("m1", ENCODED))
    assert await shelf.get(motion) is None
