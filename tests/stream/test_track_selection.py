from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.container import StoredMotion, add_audio_track, add_performers, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.motion.placement import STAGE_CENTRE
from bunraku.stream.track_selection import (
    TRACK_TYPES,
    build_allocations,
    count_channels,
    count_described_tracks,
    motion_bitrates,
    pack_description,
    select_tracks,
)
from bunraku.wire.messages import Description
from bunraku.wire.messages import unpack as unpack_message
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    """Return a motion with a camera and audio."""
    encoded = encode_motion(random_motion(2.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    filmed = unpack_motion(
        "m", pack_motion("m", encoded, [encode_scene(sample_camera(2.0, 30.0), error_bounds_mm=(20.0, 4.0))])
    )
    noise = np.random.default_rng(2).normal(0, 0.2, (96_000, 1)).astype(np.float32)
    return unpack_motion("m", add_audio_track("m", filmed, encode_audio([noise], filmed.first_track, 1))[0])


def test_channels_of_all_tracks_are_counted(motion: StoredMotion) -> None:
    assert count_channels(motion) == 19 + 3 + 1


def described_types(message: bytes) -> list[str]:
    description = unpack_message(message)
    assert isinstance(description, Description)
    return [track["type"] for track in description.tracks]


def test_tracks_after_last_selected_one_are_not_described(motion: StoredMotion) -> None:
    complete = described_types(motion.description)
    assert sorted(complete) == ["audio", "camera", "motion"]
    assert [
        count_described_tracks(motion, track_types)
        for track_types in (TRACK_TYPES, complete[:1], complete[1:2], complete[2:], ())
    ] == [3, 1, 2, 3, 1]
    assert pack_description(motion, 0, 3) == motion.description
    assert described_types(pack_description(motion, 0, 2)) == complete[:2]


def test_partial_description_holds_index_of_first_track(motion: StoredMotion) -> None:
    complete = described_types(motion.description)
    rest = pack_description(motion, 1, 3)
    assert described_types(rest) == complete[1:]
    assert len(rest) + len(pack_description(motion, 0, 1)) < len(motion.description) + 40
    found = unpack_message(rest)
    assert isinstance(found, Description)
    assert found.first == 1


def test_selected_tracks_keep_their_index_and_type(motion: StoredMotion) -> None:
    complete = described_types(motion.description)
    found = select_tracks(motion, ("audio", "camera"))
    assert [track.index for track in found] == [1, 2]
    assert [track.is_audio for track in found] == [kind == "audio" for kind in complete[1:]]
    assert [track.is_motion for track in select_tracks(motion, TRACK_TYPES)] == [True, False, False]


def test_allocations_cover_selected_motion_and_audio(motion: StoredMotion) -> None:
    assert {step.audio_level for step in build_allocations(motion, ("motion",))} == {-1}
    assert [step.motion_level for step in build_allocations(motion, ("motion",))] == [0, 1]
    both = build_allocations(motion, TRACK_TYPES)
    assert both[0].audio_level == -1
    assert both[-1].kbps == max(step.kbps for step in both)
    assert len(build_allocations(motion, ("audio",))) == both[-1].audio_level + 1


def test_bitrates_of_performers_are_added(motion: StoredMotion) -> None:
    single = unpack_motion(
        "s", pack_motion("s", encode_motion(random_motion(1.0, 30.0, 4), error_bounds_mm=(20.0,), grade="live"))
    )
    both = unpack_motion("b", add_performers("b", motion, [single, motion], [STAGE_CENTRE] * 3)[0])
    low, high = motion.bitrates_kbps[0]
    assert motion_bitrates(both) == pytest.approx(
        [2 * low + single.bitrates_kbps[0][0], 2 * high + single.bitrates_kbps[0][0]]
    )
    assert build_allocations(both, ("motion",))[-1].kbps == motion_bitrates(both)[-1]
    assert count_channels(both) == 3 * 19 + 3 + 1
    assert [track.is_motion for track in select_tracks(both, TRACK_TYPES)] == [True] * 3 + [False] * 2
    assert [track.level_count for track in select_tracks(both, ("motion",))] == [2, 1, 2]
