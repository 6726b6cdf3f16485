from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgpack
import pytest

from bunraku.codec import container
from bunraku.codec.audio import AudioTrack, EncodedAudio, create_audio_track, pack_audio_level, unpack_audio_block
from bunraku.codec.container import StoredMotion, add_audio_track, add_performers, pack_motion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import encode_scene
from bunraku.motion.placement import Placement
from bunraku.storage import motion_store
from bunraku.storage.motion_store import MotionStore
from bunraku.wire.messages import Data, Description, unpack
from tests.vectors import audio as sounds
from tests.vectors import scene as scenes
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


async def test_camera_and_light_are_separate_tracks(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    scene_tracks = [
        encode_scene(scenes.sample_camera(2.5, 30.0), error_bounds_mm=(10.0,)),
        encode_scene(scenes.sample_light(2.0, 24.0)),
    ]
    await store.put("m1", pack_motion("m1", ENCODED, scene_tracks))
    stored = await store.get("m1")
    assert stored is not None
    assert [len(track) for track in stored.packets] == [2, 1, 5]
    assert stored.first_track.figure.offsets.shape == (18, 3)
    assert stored.performers[0].front == round(ENCODED.front, 3)
    assert stored.total_bytes > sum(len(packet) for rate in stored.first_packets for packet in rate) + len(
        stored.description
    )
    for number, kind in ((1, "camera"), (2, "light")):
        track = stored.tracks[number]
        assert isinstance(track, SceneTrack)
        assert track.kind == kind
        for rate, packets in enumerate(stored.packets[number]):
            for index, packet in enumerate(packets):
                data = unpack(packet)
                assert isinstance(data, Data)
                assert (data.track, data.rate, data.index) == (number, rate, index)
                assert decode_scene_block(track, data.block).frames == track.frames_in(index)


def test_more_than_16_tracks_are_rejected() -> None:
    still = encode_scene(scenes.sample_camera(0.1, 30.0), error_bounds_mm=(10.0,))
    assert len(container.unpack_motion("m", pack_motion("m", ENCODED, [still] * 15)).tracks) == 16
    with pytest.raises(ValueError, match="at most 16 tracks, not 17"):
        pack_motion("m", ENCODED, [still] * 16)


def encoded_audio(stored: StoredMotion, seconds: float) -> EncodedAudio:
    track = create_audio_track(stored.first_track, 2, 120, round(seconds * 48_000))
    return EncodedAudio(
        track, [pack_audio_level(track, sounds.random_packets(track.packet_count, most, 5)) for most in (30, 300)]
    )


def test_audio_is_the_last_track_and_is_replaced() -> None:
    before = container.unpack_motion(
        "m1", pack_motion("m1", ENCODED, [encode_scene(scenes.sample_camera(2.5, 30.0), error_bounds_mm=(10.0,))])
    )
    first, kinds = add_audio_track("m2", before, encoded_audio(before, 2.0))
    assert kinds == ["motion", "camera", "audio"]
    sung = container.unpack_motion("m2", first)
    assert sung.packets[:2] == before.packets
    assert sung.bitrates_kbps[:2] == before.bitrates_kbps
    assert [len(rates) for rates in sung.bitrates_kbps] == [2, 1, 2]
    assert sung.performers[0].front == before.performers[0].front
    again, kinds = add_audio_track("m3", sung, encoded_audio(sung, 1.0))
    assert kinds == ["motion", "camera", "audio"]
    other = container.unpack_motion("m3", again)
    audio = other.tracks[2]
    assert isinstance(audio, AudioTrack)
    assert audio.samples == 48_000
    assert other.packets[:2] == before.packets
    for rate, sent in enumerate(other.packets[2]):
        for index, packet in enumerate(sent):
            data = unpack(packet)
            assert isinstance(data, Data)
            assert (data.track, data.rate, data.index) == (2, rate, index)
            assert all(audio.block_of_packet(one.number) == index for one in unpack_audio_block(data.block))


def test_audio_beside_16_tracks_is_rejected() -> None:
    still = encode_scene(scenes.sample_camera(0.1, 30.0), error_bounds_mm=(10.0,))
    full = container.unpack_motion("m", pack_motion("m", ENCODED, [still] * 15))
    with pytest.raises(ValueError, match="at most 16 tracks"):
        add_audio_track("n", full, encoded_audio(full, 1.0))


async def test_object_of_the_single_track_format_is_read(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    now = msgpack.unpackb(pack_motion("m1", ENCODED))
    await store.put("m1", msgpack.packb({"description": now["description"], "packets": now["tracks"][0]}))
    stored = await store.get("m1")
    assert stored is not None
    assert stored.packets == now["tracks"]
    assert len(stored.tracks) == 1


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
    assert store._cached_bytes == sum(stored.total_bytes for stored in cached.values())


async def test_motion_of_another_codec_is_none_until_replaced(tmp_path: Path) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put("m1", pack_motion("m1", ENCODED).replace(b"bunraku.motion/2", b"bunraku.motion/1"))
    assert await store.get("m1") is None
    await store.put("m1", pack_motion("m1", ENCODED))
    assert await store.get("m1") is not None


def test_object_is_a_single_map() -> None:
    assert set(msgpack.unpackb(pack_motion("m", ENCODED))) == {"description", "tracks"}


@pytest.mark.parametrize("motion", ["", "../m1", "a/b", "a//b", "m1\0", "é", ".", "motions/m1"])
async def test_malformed_id_is_not_found(tmp_path: Path, motion: str) -> None:
    store = MotionStore.open(f"file://{tmp_path}")
    await store.put("m1", pack_motion("m1", ENCODED))
    assert await store.get(motion) is None


def test_combined_performers_keep_their_blocks() -> None:
    camera = encode_scene(scenes.sample_camera(2.5, 30.0), error_bounds_mm=(10.0,))
    one = container.unpack_motion("one", pack_motion("one", ENCODED, [camera]))
    two = container.unpack_motion(
        "two",
        pack_motion("two", encode_motion(random_motion(1.5, 60.0, 9), error_bounds_mm=(30.0,), grade="live"), [camera]),
    )
    places = [Placement(-1.0, 0.0, 0.5), Placement(1.0, 0.0, 0.0), Placement(0.0, -2.0, 0.0)]
    packed, kinds = add_performers("three", one, [two, one], places)
    three = container.unpack_motion("three", packed)
    # cameras of the other motions are not copied
    assert kinds == ["motion", "motion", "motion", "camera"]
    assert [performer.placement for performer in three.performers] == places
    assert three.first_track.duration_us == one.first_track.duration_us
    assert three.performers[1].track.fps == 60.0
    for number, of in enumerate((one.packets[0], two.packets[0], one.packets[0], one.packets[1])):
        for packets, before in zip(three.packets[number], of, strict=True):
            for packet, was in zip(packets, before, strict=True):
                assert Data.unpack(packet) == replace(Data.unpack(was), track=number)
    with pytest.raises(ValueError, match="at most 4 performers"):
        add_performers("many", three, [three], places * 2)
    again = container.unpack_motion(
        "lit", container.replace_scene_tracks("lit", three, [camera, camera], {"camera"})[0]
    )
    assert [type(track).__name__ for track in again.tracks] == ["MotionTrack"] * 3 + ["SceneTrack"] * 2
    assert [performer.placement for performer in again.performers] == places


def test_performers_beyond_16_tracks_are_rejected() -> None:
    still = encode_scene(scenes.sample_light(0.5, 24.0), error_bounds_mm=(30.0,))
    full = container.unpack_motion("m", pack_motion("m", ENCODED, [still] * 15))
    with pytest.raises(ValueError, match="at most 16 tracks"):
        add_performers("n", full, [full], [Placement(), Placement()])
