import numpy as np
import pytest

from bunraku.capture.retarget import Pose
from bunraku.capture.session import TimedPose
from bunraku.capture.take import make_motion
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure


def pose_at(time_s: float) -> TimedPose:
    """Pose of a movement at constant speed."""
    turn = rotation.from_rotation_vector(np.array([0.0, 0.5 * time_s, 0.0]))
    return TimedPose(10.0 + time_s, Pose(np.array([time_s, 1.0, 0.0]), np.tile(turn, (JOINT_COUNT, 1)), {}))


def test_frames_are_interpolated_at_the_constant_rate() -> None:
    times = [0.0, 0.031, 0.07, 0.1, 0.5, 0.503, 1.0]
    motion = make_motion(standard_figure(), [pose_at(time) for time in times], 30.0)
    assert (motion.frame_count, motion.fps) == (31, 30.0)
    np.testing.assert_allclose(motion.root[:, 0], np.arange(31) / 30.0, atol=1e-9)
    expected = rotation.from_rotation_vector(np.array([[0.0, frame / 60.0, 0.0] for frame in range(31)]))
    np.testing.assert_allclose(np.abs(np.sum(motion.rotations[:, 5] * expected, axis=-1)), 1.0, atol=1e-12)


def test_single_pose_is_one_frame_and_none_is_no_motion() -> None:
    motion = make_motion(standard_figure(), [pose_at(0.25)], 60.0)
    assert motion.frame_count == 1
    np.testing.assert_allclose(motion.root, [[0.25, 1.0, 0.0]])
    with pytest.raises(ValueError, match="without a pose"):
        make_motion(standard_figure(), [], 60.0)
