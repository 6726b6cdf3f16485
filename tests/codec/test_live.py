import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.live import TARGET_ERROR_MM, LiveEncoder, LiveTrack
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, Motion, joint_and_tip_positions, standard_figure
from bunraku.playout.performance import sample_pose
from bunraku.wire.live import MAX_LIVE_BLOCK_BYTES, MAX_ROOT_M, Sample

REST = Motion(standard_figure(), 60.0, np.array([[0.0, 0.9, 0.0]]), np.tile(rotation.IDENTITY, (1, JOINT_COUNT, 1)))
SKELETON = plan_motion_track(REST).skeleton


def make_motion(frames: int = 240) -> Motion:
    """Swing all joints and walk in a circle, at 60 frames per second."""
    t = np.arange(frames) / 60.0
    vectors = np.zeros((frames, JOINT_COUNT, 3))
    for joint in range(JOINT_COUNT):
        vectors[:, joint] = 0.3 * np.sin(t[:, None] * (1.0 + 0.1 * joint) + np.arange(3) + joint)
    root = np.stack([np.sin(0.5 * t), 0.9 + 0.02 * np.sin(4 * t), np.cos(0.5 * t)], axis=-1)
    return Motion(standard_figure(), 60.0, root, rotation.from_rotation_vector(vectors))


def encode(encoder: LiveEncoder, motion: Motion, frames: int) -> tuple[list[bytes], list[float]]:
    encoded = [
        encoder.encode(motion.root[at : at + frames], motion.rotations[at : at + frames])
        for at in range(0, motion.frame_count, frames)
    ]
    return [one.data for one in encoded], [one.mean_error_mm for one in encoded]


@pytest.mark.parametrize("frames", [1, 2, 4])
def test_error_follows_the_target_and_is_that_of_the_decoded_poses(frames: int) -> None:
    motion = make_motion()
    encoder = LiveEncoder(plan_motion_track(motion).skeleton)
    blocks, errors = encode(encoder, motion, frames)
    assert np.mean(errors[20:]) == pytest.approx(TARGET_ERROR_MM, rel=0.4)
    decoder = LiveTrack(plan_motion_track(motion).skeleton)
    for nth, (block, error) in enumerate(zip(blocks, errors, strict=True)):
        poses = decoder.decode(frames, block).pose_at(np.arange(float(frames)))
        part = slice(nth * frames, (nth + 1) * frames)
        assert distance_mm(motion, part, poses) == pytest.approx(error, rel=1e-3, abs=1e-3)


def distance_mm(motion: Motion, part: slice, poses: tuple[Array, Array]) -> float:
    decoded = joint_and_tip_positions(LiveTrack(plan_motion_track(motion).skeleton).track(1).figure, *poses)
    truth = joint_and_tip_positions(motion.figure, motion.root[part], motion.rotations[part])
    return float(np.linalg.norm(decoded - truth, axis=-1).mean() * 1e3)


def test_bitrate_of_two_frames_at_a_time_is_low() -> None:
    motion = make_motion()
    blocks, _ = encode(LiveEncoder(plan_motion_track(motion).skeleton), motion, 2)
    assert sum(map(len, blocks)) * 8e-3 / motion.duration < 25.0


def test_still_pose_always_has_the_same_block() -> None:
    motion = make_motion(2)
    encoder = LiveEncoder(plan_motion_track(motion).skeleton)
    still = np.repeat(motion.root[:1], 2, axis=0), np.repeat(motion.rotations[:1], 2, axis=0)
    blocks = [encoder.encode(*still).data for _ in range(200)]
    # once the step has settled, nothing may tremble
    assert len(set(blocks[-50:])) == 1


def test_damaged_block_is_rejected_or_decoded() -> None:
    motion = make_motion(2)
    encoder = LiveEncoder(plan_motion_track(motion).skeleton)
    block = encoder.encode(motion.root, motion.rotations).data
    rejected = 0
    for bit in range(8 * len(block)):
        damaged = bytearray(block)
        damaged[bit // 8] ^= 1 << bit % 8
        try:
            assert encoder.live_track.decode(2, bytes(damaged)).frames == 2
        except DamagedBlock:
            rejected += 1
    assert rejected > 0


coordinates = st.floats(-MAX_ROOT_M, MAX_ROOT_M, width=32)
turns = st.binary(min_size=6 * JOINT_COUNT, max_size=6 * JOINT_COUNT) | st.sampled_from([b"\xff\x7f", b"\0\x80"])
samples = st.builds(
    lambda root, data: Sample(0, 0, root, tuple(np.resize(np.frombuffer(data, "<i2"), 3 * JOINT_COUNT).tolist())),
    st.tuples(coordinates, coordinates, coordinates),
    turns,
)


@given(st.lists(samples, min_size=2, max_size=2))
def test_poses_of_any_samples_fit_a_message(pair: list[Sample]) -> None:
    roots, rotations = zip(*map(sample_pose, pair), strict=True)
    encoder = LiveEncoder(SKELETON)
    encoded = encoder.encode(np.array(roots), np.array(rotations))
    assert len(encoded.data) <= MAX_LIVE_BLOCK_BYTES
    assert np.isfinite(encoded.mean_error_mm)
    root, shown = encoder.live_track.decode(2, encoded.data).pose_at(np.arange(2.0))
    assert np.isfinite(root).all()
    assert np.linalg.norm(shown, axis=-1) == pytest.approx(1.0)
