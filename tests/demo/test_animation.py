import numpy as np
import pytest

from bunraku.demo import animation
from bunraku.demo.score import Arm
from bunraku.motion import rotation, skeleton
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Motion, standard_figure
from tests.demo.test_score import DOWN, OUT, SCORE

FIGURE = standard_figure()


@pytest.fixture(scope="module")
def motion() -> Motion:
    return animation.animate(SCORE, FIGURE, 60.0)


def position_in_chest(motion: Motion, frame: int, joint: str) -> Array:
    """Return the position of a joint relative to the shoulder of its side, along the axes of the chest."""
    position, orientation = skeleton.world_transforms(motion.figure, motion.root[frame], motion.rotations[frame])
    chest = rotation.conjugate(orientation[JOINT_INDEX["vl5"]])
    return rotation.rotate(chest, position[JOINT_INDEX[joint]] - position[JOINT_INDEX[f"{joint[0]}_shoulder"]])


def test_motion_has_the_frames_of_the_score(motion: Motion) -> None:
    assert motion.frame_count == 300
    assert motion.duration == SCORE.duration
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0)


@pytest.mark.parametrize(("joint", "arm"), [("l_wrist", OUT), ("r_wrist", DOWN)])
def test_wrists_match_the_pose_at_a_key(motion: Motion, joint: str, arm: Arm) -> None:
    frame = round(2.2 * SCORE.seconds_per_beat * 60)
    straight = np.linalg.norm(FIGURE.offsets[JOINT_INDEX["l_elbow"]] + FIGURE.offsets[JOINT_INDEX["l_wrist"]])
    side = 1.0 if joint[0] == "l" else -1.0
    wanted = np.array(arm.wrist_position) * [side, 1.0, 1.0]
    # an arm reaches as far as it hangs, no further
    wanted *= straight / max(1.0, float(np.linalg.norm(wanted)))
    assert position_in_chest(motion, frame, joint) == pytest.approx(wanted, abs=0.005)


def test_trunk_and_head_match_the_pose_at_a_key(motion: Motion) -> None:
    frame = round(2.4 * SCORE.seconds_per_beat * 60)
    position, orientation = skeleton.world_transforms(motion.figure, motion.root[frame], motion.rotations[frame])
    left, right = position[JOINT_INDEX["l_shoulder"]], position[JOINT_INDEX["r_shoulder"]]
    # twisted 10 degrees to the right, the hips still facing 0..-4: the left shoulder comes forward
    across = left - right
    assert -16.0 < np.degrees(np.arctan2(-across[2], across[0])) < -8.0
    gaze = rotation.rotate(orientation[JOINT_INDEX["skullbase"]], np.array([0.0, 0.0, 1.0]))
    assert 12.0 < np.degrees(np.arctan2(gaze[0], gaze[2])) < 22.0


def test_last_frame_leads_to_the_first(motion: Motion) -> None:
    points = skeleton.joint_and_tip_positions(motion.figure, motion.root, motion.rotations)
    step = np.linalg.norm(points[0] - points[-1], axis=-1).max()
    assert step < 0.001


def test_pose_at_a_time_is_independent_of_frame_rate(motion: Motion) -> None:
    slow = animation.animate(SCORE, FIGURE, 20.0)
    assert np.allclose(slow.root, motion.root[::3], rtol=0, atol=1e-9)
    assert np.allclose(slow.rotations, motion.rotations[::3], rtol=0, atol=1e-9)
