import numpy as np
import pytest

from bunraku.demo import animation, mass, poses
from bunraku.demo.score import FootPlacement, Pose, PoseKey, Score
from bunraku.motion import rotation, skeleton
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure

FIGURE = standard_figure()
POSE_NAMES = sorted(name for name, value in vars(poses).items() if isinstance(value, Pose))


@pytest.mark.parametrize("name", POSE_NAMES)
def test_held_pose_keeps_hands_out_of_the_body_and_apart(name: str) -> None:
    pose = getattr(poses, name)
    feet = FootPlacement(0.12, 0.0, 8), FootPlacement(-0.12, 0.0, -8)
    score = Score(60.0, 12, poses.STAND, *feet, (PoseKey(3, pose, 3), PoseKey(11, poses.STAND, 3)), ())
    motion = animation.animate(score, FIGURE, 10.0)
    root, rotations = motion.root[50], motion.rotations[50]
    points = skeleton.joint_and_tip_positions(FIGURE, root, rotations)
    _, orientation = skeleton.world_transforms(FIGURE, root, rotations)
    chest = JOINT_INDEX["vl5"]
    hands = []
    for side, tip in (("l", mass.LEFT_HAND), ("r", mass.RIGHT_HAND)):
        elbow, wrist = points[JOINT_INDEX[f"{side}_elbow"]], points[JOINT_INDEX[f"{side}_wrist"]]
        along = np.linspace(0.0, 1.0, 9)[:, None]
        line = np.concatenate([elbow + along * (wrist - elbow), wrist + along * (points[tip] - wrist)])
        hands.append(line)
        x, y, z = rotation.rotate(rotation.conjugate(orientation[chest]), line - points[chest]).T
        # the bodice is an oval of 154 by 116 mm half axes about 40 mm before vl5
        beside = (x / 0.154) ** 2 + ((z - 0.04) / 0.116) ** 2
        assert np.all(beside[(y > -0.05) & (y < 0.4)] > 1.2)
        skull = points[JOINT_INDEX["skullbase"]] + 0.5 * (points[mass.CROWN] - points[JOINT_INDEX["skullbase"]])
        assert np.linalg.norm(line - skull, axis=1).min() > 0.13
    gap = np.linalg.norm(hands[0][:, None] - hands[1][None], axis=-1).min()
    assert gap > 0.08


def test_crossed_hands_are_past_each_other() -> None:
    feet = FootPlacement(0.08, 0.0), FootPlacement(-0.08, 0.0)
    score = Score(60.0, 12, poses.STAND, *feet, (PoseKey(3, poses.CROSSED, 3), PoseKey(11, poses.STAND, 3)), ())
    motion = animation.animate(score, FIGURE, 10.0)
    points = skeleton.joint_and_tip_positions(FIGURE, motion.root[50], motion.rotations[50])
    assert points[mass.LEFT_HAND, 0] < points[mass.RIGHT_HAND, 0] - 0.1
