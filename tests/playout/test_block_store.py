from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.contact import encode_contacts
from bunraku.codec.extension.props import encode_props
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneSamples
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import EncodedScene, encode_scene
from bunraku.motion import rotation
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import ContactBlockStore, MotionBlockStore, PropBlockStore, SceneBlockStore
from bunraku.wire.prop import PropState
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera

MOTION = random_motion(4.0, 30.0, 3)
ENCODED = encode_motion(MOTION, error_bounds_mm=(20.0, 2.0), grade="live")


def filled_store(*indices: int, level: int = 1) -> MotionBlockStore:
    store = MotionBlockStore(ENCODED.track)
    for index in indices:
        store.put(index, level, decode_motion_block(ENCODED.track, ENCODED.ladder[level].blocks[index]))
    return store


def test_pose_matches_motion_at_every_frame() -> None:
    store = filled_store(0, 1, 2, 3)
    for frame in (0, 17, 29, 30, 59, 60, 101):
        pose = store.pose_at(round(frame * 1e6 / 30))
        assert pose is not None
        truth = joint_and_tip_positions(MOTION.figure, MOTION.root[frame], MOTION.rotations[frame])
        assert np.linalg.norm(joint_and_tip_positions(ENCODED.track.figure, *pose) - truth, axis=-1).max() < 0.01


def test_pose_is_continuous_across_blocks() -> None:
    store = filled_store(0, 1, 2, 3)
    times = np.arange(900_000, 1_100_000, 1_000)
    shown = [joint_and_tip_positions(ENCODED.track.figure, *pose) for t in times if (pose := store.pose_at(int(t)))]
    assert len(shown) == len(times)
    assert np.abs(np.diff(shown, axis=0)).max() < 0.02


def test_missing_block_has_no_pose_and_higher_level_is_kept() -> None:
    store = filled_store(0, 2)
    assert store.pose_at(1_500_000) is None
    assert store.pose_at(999_000) is not None
    assert not store.put(0, 0, decode_motion_block(ENCODED.track, ENCODED.ladder[0].blocks[0]))
    assert [store.level(i) for i in range(4)] == [1, -1, 1, -1]


def test_buffered_time_ends_at_first_gap() -> None:
    store = filled_store(0, 1, 3)
    assert store.buffered_us(500_000, loop=True) == 1_500_000
    assert store.buffered_us(2_500_000, loop=True) == 0
    assert store.buffered_us(3_200_000, loop=True) == 800_000 + 2_000_000
    assert store.buffered_us(3_200_000, loop=False) == 800_000
    assert (
        filled_store(0, 1, 2, 3).buffered_us(1_000_000, loop=True) == ENCODED.track.start_us(1) + 4_000_000 - 1_000_000
    )


def test_pose_is_continuous_at_end_of_loop() -> None:
    store = filled_store(0, 1, 2, 3)
    end = store.pose_at(ENCODED.track.duration_us - 1_000, loop=True)
    begin = store.pose_at(0)
    assert end is not None
    assert begin is not None
    np.testing.assert_allclose(end[0], begin[0], atol=0.05)
    turn = rotation.to_rotation_vector(rotation.multiply(rotation.conjugate(end[1]), begin[1]))
    assert np.linalg.norm(turn, axis=-1).max() < 0.2


def test_blocks_of_another_motion_are_rejected() -> None:
    store = filled_store()
    other = encode_motion(random_motion(0.7, 30.0, 3), error_bounds_mm=(20.0,), grade="live")
    with pytest.raises(ValueError, match="not belong to this track"):
        store.put(3, 0, decode_motion_block(other.track, other.ladder[0].blocks[0]))
    with pytest.raises(ValueError, match="not belong to this track"):
        store.put(4, 0, decode_motion_block(ENCODED.track, ENCODED.ladder[0].blocks[0]))


def filled_scene_store(scene: SceneSamples, *missing: int) -> tuple[EncodedScene, SceneBlockStore]:
    encoded = encode_scene(scene, error_bounds_mm=(1.0,))
    store = SceneBlockStore(encoded.track)
    for index, block in enumerate(encoded.ladder[0].blocks):
        if index not in missing:
            store.put(index, 0, decode_scene_block(encoded.track, block))
    return encoded, store


def test_camera_matches_scene_and_is_none_if_block_is_missing() -> None:
    scene = sample_camera(4.0, 30.0)
    _, store = filled_scene_store(scene, 2)
    for frame in (0, 17, 29, 30, 59, 90, 119):
        values = store.values_at(round(frame * 1e6 / 30), True, 4_000_000)
        assert values is not None
        np.testing.assert_allclose(values, scene.values[frame], atol=2e-3)
    assert store.values_at(2_500_000, True, 4_000_000) is None


def test_camera_is_interpolated_between_blocks_and_at_loop_end() -> None:
    scene = sample_camera(4.0, 30.0)
    _, store = filled_scene_store(scene)
    for before, after in ((29, 30), (119, 0)):
        quarter = store.values_at(round((before + 0.25) * 1e6 / 30), True, 4_000_000)
        assert quarter is not None
        truth = 0.75 * scene.values[before] + 0.25 * scene.values[after]
        np.testing.assert_allclose(quarter, truth, atol=2e-3)
    last = store.values_at(4_000_000, False, 4_000_000)
    assert last is not None
    np.testing.assert_allclose(last, scene.values[-1], atol=0.02)


def test_shorter_camera_is_constant_past_its_end() -> None:
    scene = sample_camera(2.0, 30.0)
    _, store = filled_scene_store(scene)
    for position in (1_980_000, 2_000_000, 2_400_000, 3_999_999):
        values = store.values_at(position, True, 4_000_000)
        assert values is not None
        np.testing.assert_allclose(values, scene.values[-1], atol=0.02)


def test_shorter_track_is_constant_past_its_end_and_longer_one_is_cut() -> None:
    store = filled_store(0, 1, 2, 3)
    shown, alone = store.pose_at(6_000_000, True, 8_000_000), store.pose_at(4_000_000, False)
    assert shown is not None
    assert alone is not None
    np.testing.assert_array_equal(shown[1], alone[1])
    for duration in (2_000_000, ENCODED.track.duration_us, None):
        assert store.pose_at(1_000_000, True, duration) is not None
    # at the end of a motion of equal duration the pose is interpolated with the first frame
    seam, cut = store.pose_at(3_999_000, True, 4_000_000), store.pose_at(6_000_000, True, 8_000_000)
    assert seam is not None
    assert cut is not None
    assert np.abs(seam[0] - cut[0]).max() > 1e-6
    (still,) = store.poses_at([6_000_000], True, 8_000_000)
    assert still is not None
    for values, expected in zip(still, cut, strict=True):
        np.testing.assert_allclose(values, expected, atol=1e-12)


def test_contacts_are_those_of_the_frame_that_began() -> None:
    planted = np.stack([np.arange(120) % 3 == 0, np.arange(120) % 7 < 3], axis=1)
    encoded = encode_contacts(planted, ENCODED.track)
    store = ContactBlockStore(encoded.track)
    assert store.contacts_at(0) is None
    for index, block in enumerate(encoded.ladder[0].blocks):
        assert store.put_encoded(index, 0, block)
    for frame in range(120):
        for position in (round(frame * 1e6 / 30), round((frame + 0.9) * 1e6 / 30)):
            found = store.contacts_at(position)
            assert found is not None
            np.testing.assert_array_equal(found, planted[frame])
    with pytest.raises(DamagedBlock):
        store.put_encoded(0, 0, b"")
    with pytest.raises(ValueError, match="does not belong"):
        store.put_encoded(99, 0, encoded.ladder[0].blocks[0])


def test_props_are_those_of_the_frame_that_began() -> None:
    states = [PropState(frame % 2) if frame % 5 else None for frame in range(120)]
    encoded = encode_props(["fan"], [states], ENCODED.track)
    store = PropBlockStore(encoded.track)
    assert store.states_at(0) is None
    for index, block in enumerate(encoded.ladder[0].blocks):
        assert store.put_encoded(index, 0, block)
    for frame in range(120):
        for position in (round(frame * 1e6 / 30), round((frame + 0.9) * 1e6 / 30)):
            assert store.states_at(position) == (states[frame],)
    with pytest.raises(DamagedBlock):
        store.put_encoded(0, 0, b"")
    with pytest.raises(ValueError, match="does not belong"):
        store.put_encoded(99, 0, encoded.ladder[0].blocks[0])
