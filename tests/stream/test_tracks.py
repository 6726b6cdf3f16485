from __future__ import annotations

import numpy as np
import pytest

from bunraku.backing.library import StoredMotion, pack, unpack, with_audio, with_performers
from bunraku.codec.encode import encode_motion
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.opus import encode_audio
from bunraku.motion.place import MIDDLE
from bunraku.stream.tracks import TRACKS, channels, danced, described, paced, steps, told_of
from bunraku.wire.messages import Description
from bunraku.wire.messages import unpack as unpack_message
from tests.vectors.blocks import wandering_motion
from tests.vectors.scene import camera


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    """A motion with a camera, then noise."""
    encoded = encode_motion(wandering_motion(2.0, 30.0, 9), ladder=(30.0, 5.0), grade="live")
    filmed = unpack("m", pack("m", encoded, [encode_scene(camera(2.0, 30.0), ladder=(20.0, 4.0))]))
    noise = np.random.default_rng(2).normal(0, 0.2, (96_000, 1)).astype(np.float32)
    return unpack("m", with_audio("m", filmed, encode_audio([noise], filmed.track, 1))[0])


def test_all_channels_are_counted(motion: StoredMotion) -> None:
    assert channels(motion) == 19 + 3 + 1


def kinds(message: bytes) -> list[str]:
    description = unpack_message(message)
    assert isinstance(description, Description)
    return [track["type"] for track in description.tracks]


def test_what_comes_after_the_last_track_that_is_wanted_is_not_described(motion: StoredMotion) -> None:
    whole = kinds(motion.description)
    assert sorted(whole) == ["audio", "camera", "motion"]
    assert [told_of(motion, wanted) for wanted in (TRACKS, whole[:1], whole[1:2], whole[2:], ())] == [3, 1, 2, 3, 1]
    assert described(motion, 0, 3) == motion.description
    assert kinds(described(motion, 0, 2)) == whole[:2]


def test_the_rest_says_which_track_it_begins_with(motion: StoredMotion) -> None:
    whole = kinds(motion.description)
    rest = described(motion, 1, 3)
    assert kinds(rest) == whole[1:]
    assert len(rest) + len(described(motion, 0, 1)) < len(motion.description) + 40
    found = unpack_message(rest)
    assert isinstance(found, Description)
    assert found.first == 1


def test_tracks_keep_their_numbers_and_say_what_they_are(motion: StoredMotion) -> None:
    whole = kinds(motion.description)
    found = paced(motion, ("audio", "camera"))
    assert [track.number for track in found] == [1, 2]
    assert [track.audio for track in found] == [kind == "audio" for kind in whole[1:]]
    assert [track.base for track in paced(motion, TRACKS)] == [True, False, False]


def test_motion_and_sound_share_the_line_where_both_are_wanted(motion: StoredMotion) -> None:
    assert {step.audio for step in steps(motion, ("motion",))} == {-1}
    assert [step.motion for step in steps(motion, ("motion",))] == [0, 1]
    both = steps(motion, TRACKS)
    assert both[0].audio == -1
    assert both[-1].kbps == max(step.kbps for step in both)
    assert len(steps(motion, ("audio",))) == both[-1].audio + 1


def test_rates_of_several_performers_are_chosen_and_paid_for_together(motion: StoredMotion) -> None:
    single = unpack("s", pack("s", encode_motion(wandering_motion(1.0, 30.0, 4), ladder=(20.0,), grade="live")))
    both = unpack("b", with_performers("b", motion, [single, motion], [MIDDLE] * 3)[0])
    low, high = motion.kbps[0]
    assert danced(both) == pytest.approx([2 * low + single.kbps[0][0], 2 * high + single.kbps[0][0]])
    assert steps(both, ("motion",))[-1].kbps == danced(both)[-1]
    assert channels(both) == 3 * 19 + 3 + 1
    assert [track.base for track in paced(both, TRACKS)] == [True] * 3 + [False] * 2
    assert [track.rates for track in paced(both, ("motion",))] == [2, 1, 2]
