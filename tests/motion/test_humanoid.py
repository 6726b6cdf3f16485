import numpy as np

from bunraku.motion import rotation
from bunraku.motion.humanoid import (
    BONE_JOINTS,
    BONE_PARENTS,
    BONES,
    bone_offsets,
    bone_rotations,
    hips_position,
    rest_hips_position,
)
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure, world_transforms
from tests.motion.synthetic_motion import smooth_motion

FIGURE = standard_figure()


def test_arms_of_the_t_pose_are_level_and_the_rest_hangs_and_stands() -> None:
    places = bone_offsets(FIGURE)
    for bone, parent in enumerate(BONE_PARENTS[1:], 1):
        places[bone] += places[parent]
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        upper, lower, hand = (places[BONES.index(f"{side}{bone}")] for bone in ("UpperArm", "LowerArm", "Hand"))
        for arm in (lower - upper, hand - lower):
            assert sign * arm[0] > 0.95 * np.linalg.norm(arm)
        thigh = places[BONES.index(f"{side}LowerLeg")] - places[BONES.index(f"{side}UpperLeg")]
        assert -thigh[1] > 0.95 * np.linalg.norm(thigh)
    assert rest_hips_position(FIGURE)[1] + places[BONES.index("Head"), 1] > 1.5


def test_every_joint_is_where_its_bone_is() -> None:
    motion = smooth_motion(seed=3)
    # the figure's spine hangs from the root, that of the humanoid from the hips, which turn with the sacroiliac
    motion.rotations[:, JOINT_INDEX["sacroiliac"]] = rotation.IDENTITY
    positions, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    offsets, turns = bone_offsets(motion.figure), bone_rotations(motion.rotations)
    world = np.empty((motion.frame_count, len(BONES), 3))
    world[:, 0] = hips_position(motion.figure, motion.root, motion.rotations)
    facing = turns.copy()
    for bone, parent in enumerate(BONE_PARENTS[1:], 1):
        world[:, bone] = world[:, parent] + rotation.rotate(facing[:, parent], offsets[bone])
        facing[:, bone] = rotation.multiply(facing[:, parent], turns[:, bone])
    for name, joint in BONE_JOINTS.items():
        np.testing.assert_allclose(world[:, BONES.index(name)], positions[:, JOINT_INDEX[joint]], atol=1e-9)
    assert turns.shape == (motion.frame_count, len(BONES), 4)
