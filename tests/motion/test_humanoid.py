import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.humanoid import (
    BONE_JOINTS,
    BONE_PARENTS,
    BONES,
    T_POSE_TO_REST,
    bone_offsets,
    bone_rotations,
    extended_bones,
    hips_position,
    rest_hips_position,
)
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, standard_figure, world_transforms
from tests.motion.extended_source import extended_source
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


@pytest.mark.parametrize(("spine_count", "neck_count"), [(0, 0), (1, 1), (2, 0), (4, 1)])
def test_extended_bones_place_head_and_hands_where_the_pose_has_them(spine_count: int, neck_count: int) -> None:
    analysis = analyse(extended_source(20, spine_count=spine_count, neck_count=neck_count))
    assert analysis.extension is not None
    motion, extension = analysis.motion, analysis.extension.extension
    placed = world_transforms(motion.figure, motion.root[7:8], motion.rotations[7:8])
    pose = extend_pose(motion.figure, extension, *placed, analysis.extension.values[7:8])
    positions, rotations = extended_bones(extension, pose)
    world: list[tuple[Array, Array]] = []
    for bone, parent in enumerate(BONE_PARENTS):
        at, turn = positions[bone], rotations[bone]
        if parent >= 0:
            at = world[parent][0] + rotation.rotate(world[parent][1], at)
            turn = rotation.multiply(world[parent][1], turn)
        world.append((at, turn))
    for name in ("Head", "LeftUpperArm", "LeftHand", "RightHand", "RightFoot"):
        joint = JOINT_INDEX[BONE_JOINTS[name]]
        at, turn = world[BONES.index(name)]
        np.testing.assert_allclose(at, pose.positions[0, joint], atol=1e-9)
        expected = rotation.multiply(pose.orientations[0, joint], T_POSE_TO_REST[joint])
        assert abs(float(turn @ expected)) == pytest.approx(1.0)
    chest = pose.extra_orientations[0, spine_count - 1] if spine_count else pose.orientations[0, 0]
    assert abs(float(world[BONES.index("UpperChest")][1] @ chest)) == pytest.approx(1.0)
