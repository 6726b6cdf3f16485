from __future__ import annotations

from pathlib import Path

import msgpack
import pytest

from bunraku.backing import library
from bunraku.backing.library import Library, pack
from bunraku.codec.decode import decode_block
from bunraku.codec.encode import encode_motion
from bunraku.wire.messages import Data, Description, unpack
from tests.vectors.blocks import wandering_motion

ENCODED = encode_motion(wandering_motion(2.5, 30.0, 8), ladder=(30.0, 5.0), grade="live")


async def test_a_motion_comes_back_ready_to_be_sent(tmp_path: Path) -> None:
    shelf = Library.open(f"file://{tmp_path}/library")
    await shelf.put("m1", pack("m1", ENCODED))
    stored = await shelf.get("m1")
    assert stored is not None
    description = unpack(stored.description)
    assert isinstance(description, Description)
    assert description.tracks[0]["rates"][1]["mean"] == round(ENCODED.rates[1].mean, 3)
    for rate, packets in enumerate(stored.packets):
        for index, packet in enumerate(packets):
            data = unpack(packet)
            assert isinstance(data, Data)
            assert (data.rate, data.index) == (rate, index)
            assert decode_block(stored.track, data.block).frames == stored.track.frames_in(index)


async def test_what_was_removed_is_gone_and_removing_it_again_is_nothing(tmp_path: Path) -> None:
    shelf = Library.open(f"file://{tmp_path}")
    await shelf.put("m1", pack("m1", ENCODED))
    await shelf.get("m1")
    await shelf.remove("m1")
    await shelf.remove("m1")
    assert await shelf.get("m1") is None
    assert await Library.open(f"file://{tmp_path}").get("m1") is None


async def test_memory_is_bounded_and_what_fell_out_is_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    shelf = Library.open("memory:///")
    packed = pack("m", ENCODED)
    monkeypatch.setattr(library, "CACHE_BYTES", 2 * len(packed))
    for number in range(5):
        await shelf.put(f"m{number}", packed)
        assert await shelf.get(f"m{number}") is not None
    kept = shelf._cache
    assert list(kept) == ["m3", "m4"] or list(kept) == ["m2", "m3", "m4"]
    assert await shelf.get("m0") is not None
    assert shelf._cached == sum(stored.size for stored in kept.values())


async def test_a_motion_of_another_codec_is_none_until_it_is_sent_again(tmp_path: Path) -> None:
    shelf = Library.open(f"file://{tmp_path}")
    await shelf.put("m1", pack("m1", ENCODED).replace(b"bunraku.motion/2", b"bunraku.motion/1"))
    assert await shelf.get("m1") is None
    await shelf.put("m1", pack("m1", ENCODED))
    assert await shelf.get("m1") is not None


def test_an_object_is_one_map() -> None:
    assert set(msgpack.unpackb(pack("m", ENCODED))) == {"description", "packets"}


@pytest.mark.parametrize("motion", ["", "../m1", "a/b", "a//b", "m1\0", "é", ".", "motions/m1"])
async def test_what_could_not_be_an_id_is_no_motion(tmp_path: Path, motion: str) -> None:
    shelf = Library.open(f"file://{tmp_path}")
    await shelf.put("m1", pack("m1", ENCODED))
    assert await shelf.get(motion) is None
