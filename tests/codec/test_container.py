from __future__ import annotations

from dataclasses import replace

import msgpack
import numpy as np
import pytest

from bunraku.codec.audio import AudioTrack, EncodedAudio, create_audio_track, pack_audio_level, unpack_audio_block
from bunraku.codec.container import (
    MAX_TRACKS,
    StoredMotion,
    add_audio_track,
    add_performers,
    pack_motion,
    replace_scene_tracks,
    unpack_motion,
)
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.contact import ContactTrack, encode_contacts
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.props import PropTrack, encode_props
from bunraku.codec.extension.track import ExtensionTrack
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import EncodedScene, encode_scene
from bunraku.motion.analysis import analyse
from bunraku.motion.placement import Placement
from bunraku.wire.messages import Data, Description, unpack
from bunraku.wire.prop import PropState
from tests.motion.extended_source import extended_source
from tests.vectors.audio import random_packets
from tests.vectors.blocks import random_motion
from tests.vectors.hands_face import make_face, make_hands
from tests.vectors.scene import sample_camera, sample_light

ENCODED = encode_motion(random_motion(2.5, 30.0, 8), error_bounds_mm=(30.0, 5.0), grade="live")
CAMERA = encode_scene(sample_camera(2.5, 30.0), error_bounds_mm=(10.0,))


def pack_and_unpack(motion_id: str, *scenes: EncodedScene) -> StoredMotion:
    return unpack_motion(motion_id, pack_motion(motion_id, ENCODED, scenes))


def data_messages(stored: StoredMotion, track: int) -> list[Data]:
    """Return the Data messages of a track, after a check of their numbers."""
    messages = []
    for level, packets in enumerate(stored.packets[track]):
        for index, packet in enumerate(packets):
            data = unpack(packet)
            assert isinstance(data, Data)
            assert (data.track, data.rate, data.index) == (track, level, index)
            messages.append(data)
    return messages


def encoded_audio(stored: StoredMotion, seconds: float) -> EncodedAudio:
    track = create_audio_track(stored.first_track, 2, 120, round(seconds * 48_000))
    return EncodedAudio(
        track, [pack_audio_level(track, random_packets(track.packet_count, size, 5)) for size in (30, 300)]
    )


def test_object_is_one_map() -> None:
    assert set(msgpack.unpackb(pack_motion("m", ENCODED))) == {"description", "tracks"}


def test_motion_round_trips_as_messages() -> None:
    stored = pack_and_unpack("m1")
    description = unpack(stored.description)
    assert isinstance(description, Description)
    assert description.motion == stored.id == "m1"
    assert description.tracks == [ENCODED.describe()]
    assert stored.bitrates_kbps == (tuple(round(level.kbps, 3) for level in ENCODED.ladder),)
    assert stored.performers[0].front == round(ENCODED.front, 3)
    assert [data.block for data in data_messages(stored, 0)] == [
        block for level in ENCODED.ladder for block in level.blocks
    ]
    for data in data_messages(stored, 0):
        assert decode_motion_block(stored.first_track, data.block).frames == stored.first_track.frames_in(data.index)


def test_cameras_and_lights_have_their_own_tracks() -> None:
    stored = pack_and_unpack("m1", CAMERA, encode_scene(sample_light(2.0, 24.0)))
    assert [len(track) for track in stored.packets] == [2, 1, 5]
    assert stored.first_track.figure.offsets.shape == (18, 3)
    assert stored.performers[0].front == round(ENCODED.front, 3)
    motion_bytes = sum(len(packet) for level in stored.first_packets for packet in level)
    assert stored.total_bytes > motion_bytes + len(stored.description)
    for number, kind in ((1, "camera"), (2, "light")):
        track = stored.tracks[number]
        assert isinstance(track, SceneTrack)
        assert track.kind == kind
        for data in data_messages(stored, number):
            assert decode_scene_block(track, data.block).frames == track.frames_in(data.index)


def test_audio_is_the_last_track_and_is_replaced() -> None:
    silent = pack_and_unpack("m1", CAMERA)
    packed, types = add_audio_track("m2", silent, encoded_audio(silent, 2.0))
    assert types == ["motion", "camera", "audio"]
    first = unpack_motion("m2", packed)
    assert first.packets[:2] == silent.packets
    assert first.bitrates_kbps[:2] == silent.bitrates_kbps
    assert [len(levels) for levels in first.bitrates_kbps] == [2, 1, 2]
    assert first.performers[0].front == silent.performers[0].front
    packed, types = add_audio_track("m3", first, encoded_audio(first, 1.0))
    assert types == ["motion", "camera", "audio"]
    second = unpack_motion("m3", packed)
    audio = second.tracks[2]
    assert isinstance(audio, AudioTrack)
    assert audio.samples == 48_000
    assert second.packets[:2] == silent.packets
    for data in data_messages(second, 2):
        assert all(audio.block_of_packet(packet.number) == data.index for packet in unpack_audio_block(data.block))


def test_performers_keep_their_blocks() -> None:
    one = pack_and_unpack("one", CAMERA)
    other = encode_motion(random_motion(1.5, 60.0, 9), error_bounds_mm=(30.0,), grade="live")
    two = unpack_motion("two", pack_motion("two", other, [CAMERA]))
    placements = [Placement(-1.0, 0.0, 0.5), Placement(1.0, 0.0, 0.0), Placement(0.0, -2.0, 0.0)]
    packed, types = add_performers("three", one, [two, one], placements)
    three = unpack_motion("three", packed)
    # the cameras of the others are not added
    assert types == ["motion", "motion", "motion", "camera"]
    assert [performer.placement for performer in three.performers] == placements
    assert three.first_track.duration_us == one.first_track.duration_us
    assert three.performers[1].track.fps == 60.0
    for number, source in enumerate((one.packets[0], two.packets[0], one.packets[0], one.packets[1])):
        for packets, source_packets in zip(three.packets[number], source, strict=True):
            for packet, source_packet in zip(packets, source_packets, strict=True):
                assert Data.unpack(packet) == replace(Data.unpack(source_packet), track=number)
    with pytest.raises(ValueError, match="at most 4 performers, this would have 6"):
        add_performers("many", three, [three], placements * 2)


def test_scene_tracks_are_replaced_and_performers_kept() -> None:
    one = pack_and_unpack("one", CAMERA)
    placements = [Placement(-1.0, 0.0, 0.5), Placement(1.0, 0.0, 0.0)]
    two = unpack_motion("two", add_performers("two", one, [one], placements)[0])
    packed, types = replace_scene_tracks("filmed", two, [CAMERA, CAMERA], {"camera"})
    filmed = unpack_motion("filmed", packed)
    assert types == ["motion"] * 2 + ["camera"] * 2
    assert [type(track).__name__ for track in filmed.tracks] == ["MotionTrack"] * 2 + ["SceneTrack"] * 2
    assert [performer.placement for performer in filmed.performers] == placements
    assert filmed.packets[:2] == two.packets[:2]


def test_more_tracks_than_a_data_message_can_number_are_refused() -> None:
    still = encode_scene(sample_camera(0.1, 30.0), error_bounds_mm=(10.0,))
    full = pack_and_unpack("m", *[still] * (MAX_TRACKS - 1))
    assert len(full.tracks) == MAX_TRACKS == 16
    with pytest.raises(ValueError, match="at most 16 tracks, this would have 17"):
        pack_motion("m", ENCODED, [still] * MAX_TRACKS)
    with pytest.raises(ValueError, match="at most 16 tracks"):
        add_audio_track("n", full, encoded_audio(full, 1.0))
    with pytest.raises(ValueError, match="at most 16 tracks"):
        add_performers("n", full, [full], [Placement(), Placement()])
    with pytest.raises(ValueError, match="at most 16 tracks"):
        replace_scene_tracks("n", full, [still], {"light"})


def test_object_with_the_packets_of_one_track_is_read() -> None:
    current = msgpack.unpackb(pack_motion("m1", ENCODED))
    old = msgpack.packb({"description": current["description"], "packets": current["tracks"][0]})
    stored = unpack_motion("m1", old)
    assert stored.packets == current["tracks"]
    assert len(stored.tracks) == 1


def test_object_of_another_codec_is_refused() -> None:
    with pytest.raises(DamagedBlock, match=r"Unsupported motion codec 'bunraku\.motion/1'"):
        unpack_motion("m1", pack_motion("m1", ENCODED).replace(b"bunraku.motion/2", b"bunraku.motion/1"))


ANALYSIS = analyse(extended_source(60))
assert ANALYSIS.extension is not None
EXTENDED = encode_motion(ANALYSIS.motion, error_bounds_mm=(30.0, 5.0), grade="live")
EXTENSION = encode_extension(ANALYSIS.extension.extension, ANALYSIS.extension.values, EXTENDED.track, [9.0, 1.5])


def extended_motion(motion_id: str, *scenes: EncodedScene) -> StoredMotion:
    return unpack_motion(motion_id, pack_motion(motion_id, EXTENDED, scenes, extensions=[EXTENSION]))


def extended_performers(stored: StoredMotion) -> list[int]:
    return [track.performer for track in stored.tracks if isinstance(track, ExtensionTrack)]


def test_extension_comes_last_and_survives_other_changes() -> None:
    stored = extended_motion("a", CAMERA)
    assert [type(track).__name__ for track in stored.tracks] == ["MotionTrack", "SceneTrack", "ExtensionTrack"]
    sung = unpack_motion("b", add_audio_track("b", stored, encoded_audio(stored, 2.0))[0])
    assert isinstance(sung.tracks[-1], ExtensionTrack)
    lit = unpack_motion("c", replace_scene_tracks("c", sung, [CAMERA, CAMERA], {"camera"})[0])
    assert isinstance(lit.tracks[-1], ExtensionTrack)
    last = len(lit.tracks) - 1
    assert [data.block for data in data_messages(lit, last)] == [b for level in EXTENSION.ladder for b in level.blocks]


def test_parts_of_all_performers_come_in_turn() -> None:
    hands, face = make_hands(1, (3,) * 10, 60), make_face(2, ["aa", "blink"], 60)
    others = [encode_extension(each, values, EXTENDED.track, [9.0, 1.5]) for each, values in (hands, face)]
    stored = unpack_motion("a", pack_motion("a", EXTENDED, extensions=[EXTENSION, *others]))
    joined, _ = add_performers("b", stored, [stored], [Placement(), Placement()])
    extensions = [track for track in unpack_motion("b", joined).tracks if isinstance(track, ExtensionTrack)]
    assert [(track.part, track.performer) for track in extensions] == [
        (part, performer) for part in ("body", "fingers", "face") for performer in (0, 1)
    ]


def test_contacts_come_after_all_other_parts_and_belong_to_their_performers() -> None:
    contacts = encode_contacts(np.ones((60, 2), dtype=bool), EXTENDED.track)
    stored = unpack_motion("a", pack_motion("a", EXTENDED, extensions=[contacts, EXTENSION]))
    assert [getattr(track, "part", None) for track in stored.tracks] == [None, "body", "contacts"]
    joined, types = add_performers("b", stored, [stored], [Placement(), Placement()])
    assert types == ["motion"] * 2 + ["extension"] * 4
    tracks = unpack_motion("b", joined).tracks
    assert [track.performer for track in tracks if isinstance(track, ContactTrack)] == [0, 1]
    assert [data.block for data in data_messages(stored, 2)] == contacts.ladder[0].blocks


def test_extensions_belong_to_their_performers() -> None:
    stored, plain = extended_motion("a", CAMERA), pack_and_unpack("b")
    placements = [Placement(float(x), 0.0, 0.0) for x in range(4)]
    packed, types = add_performers("c", stored, [plain, extended_motion("d"), extended_motion("e")], placements)
    assert types == ["motion"] * 4 + ["camera"] + ["extension"] * 3
    assert extended_performers(unpack_motion("c", packed)) == [0, 2, 3]


def test_extensions_without_a_track_number_are_left_out() -> None:
    stored = extended_motion("a")
    packed, types = replace_scene_tracks("b", stored, [CAMERA] * (MAX_TRACKS - 1), {"camera"})
    assert len(types) == MAX_TRACKS
    assert extended_performers(unpack_motion("b", packed)) == []


def test_props_come_last_and_count_limbs_from_their_performers() -> None:
    props = encode_props(["fan", "ball"], [[PropState(1)] * 60, [None] * 60], EXTENDED.track)
    stored = unpack_motion("a", pack_motion("a", EXTENDED, extensions=[props, EXTENSION]))
    assert [getattr(track, "part", None) for track in stored.tracks] == [None, "body", "props"]
    assert stored.tracks[2] == props.track
    joined, _ = add_performers("b", stored, [stored], [Placement(), Placement()])
    tracks = [track for track in unpack_motion("b", joined).tracks if isinstance(track, PropTrack)]
    assert [(track.performer, track.kinds) for track in tracks] == [(0, ("fan", "ball")), (1, ("fan", "ball"))]
