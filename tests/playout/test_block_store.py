from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneSamples
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import EncodedScene, encode_scene
from bunraku.motion import rotation
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import MotionBlockStore, SceneBlockStore
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera

MOTION = random_motion(4.0, 30.0, 3)
ENCODED = encode_motion(MOTION, error_bounds_mm=(20.0, 2.0), grade="live")


def filled_store(*indices: int, rate: int = 1) -> MotionBlockStore:
    held = MotionBlockStore(ENCODED.track)
    for index in indices:
        held.put(index, rate, decode_motion_block(ENCODED.track, ENCODED.ladder[rate].blocks[index]))
    return held


def test_it_shows_the_dance_at_every_frame() -> None:
    held = filled_store(0, 1, 2, 3)
    for frame in (0, 17, 29, 30, 59, 60, 101):
        pose = held.pose_at(round(frame * 1e6 / 30))
        assert pose is not None
        truth = joint_and_tip_positions(MOTION.figure, MOTION.root[frame], MOTION.rotations[frame])
        assert np.linalg.norm(joint_and_tip_positions(ENCODED.track.figure, *pose) - truth, axis=-1).max() < 0.01


def test_nothing_jumps_across_a_border() -> None:
    held = filled_store(0, 1, 2, 3)
    times = np.arange(900_000, 1_100_000, 1_000)
    shown = [joint_and_tip_positions(ENCODED.track.figure, *pose) for t in times if (pose := held.pose_at(int(t)))]
    assert len(shown) == len(times)
    assert np.abs(np.diff(shown, axis=0)).max() < 0.02


def test_a_missing_block_has_no_pose_and_a_better_one_stays() -> None:
    held = filled_store(0, 2)
    assert held.pose_at(1_500_000) is None
    assert held.pose_at(999_000) is not None
    assert not held.put(0, 0, decode_motion_block(ENCODED.track, ENCODED.ladder[0].blocks[0]))
    assert [held.level(i) for i in range(4)] == [1, -1, 1, -1]


def test_ahead_counts_what_is_here_without_a_gap() -> None:
    held = filled_store(0, 1, 3)
    assert held.buffered_us(500_000, loop=True) == 1_500_000
    assert held.buffered_us(2_500_000, loop=True) == 0
    assert held.buffered_us(3_200_000, loop=True) == 800_000 + 2_000_000
    assert held.buffered_us(3_200_000, loop=False) == 800_000
    assert (
        filled_store(0, 1, 2, 3).buffered_us(1_000_000, loop=True) == ENCODED.track.start_us(1) + 4_000_000 - 1_000_000
    )


def test_the_end_of_a_loop_leads_into_its_beginning() -> None:
    held = filled_store(0, 1, 2, 3)
    end = held.pose_at(ENCODED.track.duration_us - 1_000, loop=True)
    begin = held.pose_at(0)
    assert end is not None
    assert begin is not None
    np.testing.assert_allclose(end[0], begin[0], atol=0.05)
    turn = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(end[1]), begin[1]))
    assert np.linalg.norm(turn, axis=-1).max() < 0.2


def test_blocks_of_another_motion_are_refused() -> None:
    held = filled_store()
    other = encode_motion(random_motion(0.7, 30.0, 3), error_bounds_mm=(20.0,), grade="live")
    with pytest.raises(ValueError, match="not belong to this track"):
        held.put(3, 0, decode_motion_block(other.track, other.ladder[0].blocks[0]))
    with pytest.raises(ValueError, match="not belong to this track"):
        held.put(4, 0, decode_motion_block(ENCODED.track, ENCODED.ladder[0].blocks[0]))


def shown_scene(scene: SceneSamples, *missing: int) -> tuple[EncodedScene, SceneBlockStore]:
    encoded = encode_scene(scene, error_bounds_mm=(1.0,))
    held = SceneBlockStore(encoded.track)
    for index, block in enumerate(encoded.ladder[0].blocks):
        if index not in missing:
            held.put(index, 0, decode_scene_block(encoded.track, block))
    return encoded, held


def test_a_camera_is_shown_at_every_frame_and_is_none_where_its_block_is_missing() -> None:
    scene = sample_camera(4.0, 30.0)
    _, held = shown_scene(scene, 2)
    for frame in (0, 17, 29, 30, 59, 90, 119):
        values = held.scene_at(round(frame * 1e6 / 30), True, 4_000_000)
        assert values is not None
        np.testing.assert_allclose(values, scene.values[frame], atol=2e-3)
    assert held.scene_at(2_500_000, True, 4_000_000) is None


def test_a_camera_goes_over_borders_and_round_a_loop_in_a_line() -> None:
    scene = sample_camera(4.0, 30.0)
    _, held = shown_scene(scene)
    for before, after in ((29, 30), (119, 0)):
        quarter = held.scene_at(round((before + 0.25) * 1e6 / 30), True, 4_000_000)
        assert quarter is not None
        truth = 0.75 * scene.values[before] + 0.25 * scene.values[after]
        np.testing.assert_allclose(quarter, truth, atol=2e-3)
    last = held.scene_at(4_000_000, False, 4_000_000)
    assert last is not None
    np.testing.assert_allclose(last, scene.values[-1], atol=0.02)


def test_past_its_end_a_shorter_camera_stands_still_in_a_loop_too() -> None:
    scene = sample_camera(2.0, 30.0)
    _, held = shown_scene(scene)
    for position in (1_980_000, 2_000_000, 2_400_000, 3_999_999):
        values = held.scene_at(position, True, 4_000_000)
        assert values is not None
        np.testing.assert_allclose(values, scene.values[-1], atol=0.02)


def test_in_a_motion_that_goes_on_a_shorter_dance_stands_still_and_a_longer_one_begins_anew_with_it() -> None:
    held = filled_store(0, 1, 2, 3)
    shown, alone = held.pose_at(6_000_000, True, 8_000_000), held.pose_at(4_000_000, False)
    assert shown is not None
    assert alone is not None
    np.testing.assert_array_equal(shown[1], alone[1])
    for duration in (2_000_000, ENCODED.track.duration_us, None):
        assert held.pose_at(1_000_000, True, duration) is not None
    # at the seam of a motion of its own length it goes over into its beginning
    seam, cut = held.pose_at(3_999_000, True, 4_000_000), held.pose_at(6_000_000, True, 8_000_000)
    assert seam is not None
    assert cut is not None
    assert np.abs(seam[0] - cut[0]).max() > 1e-6
    (still,) = held.rotations_at([6_000_000], True, 8_000_000)
    assert still is not None
    np.testing.assert_allclose(still, cut[1], atol=1e-12)
