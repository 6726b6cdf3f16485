from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.channel_weights import channel_weights
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, PARENTS, Figure, standard_figure

FIGURE = standard_figure()
REST_POSE = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


def test_weights_decrease_along_a_limb_and_are_smallest_about_a_bone() -> None:
    weights = channel_weights(FIGURE, REST_POSE)
    chain = [np.linalg.norm(weights[1 + JOINT_INDEX[name]]) for name in ("l_hip", "l_knee", "l_ankle", "l_midtarsal")]
    assert chain == sorted(chain, reverse=True)
    assert (np.linalg.svd(weights, compute_uv=False) > 0.05).all()
    for name in ("l_knee", "r_elbow", "skullbase"):
        rows = np.linalg.norm(weights[1 + JOINT_INDEX[name]], axis=1)
        # a rotation about the second axis, the bone, moves only points off the bone
        assert rows[1] < 0.5 * min(rows[0], rows[2])


@pytest.mark.parametrize("thigh", [np.zeros(3), np.array([0.4, 0.2, 1.1]), np.array([-1.3, 0.0, 0.2])])
def test_first_axis_of_a_bent_knee_is_its_hinge(thigh: rotation.Array) -> None:
    bent, hip, knee = REST_POSE.copy(), JOINT_INDEX["l_hip"], JOINT_INDEX["l_knee"]
    bent[hip], bent[knee] = rotation.from_rotation_vector(np.array([thigh, [0.8, 0.0, 0.3]]))
    parent_bone = rotation.rotate(rotation.conjugate(bent[knee]), FIGURE.offsets[knee])
    hinge = np.cross(parent_bone, FIGURE.offsets[JOINT_INDEX["l_ankle"]])
    weighted_hinge = channel_weights(FIGURE, bent)[1 + knee] @ hinge
    assert abs(weighted_hinge[0]) > 20 * max(abs(weighted_hinge[1]), abs(weighted_hinge[2]))


@pytest.mark.parametrize("seed", range(6))
def test_axes_do_not_depend_on_the_frames_of_the_bones(seed: int) -> None:
    """If the frames of all bones and the rotations change alike, the coefficients stay the same."""
    random = np.random.default_rng(seed)
    frames = rotation.from_rotation_vector(random.normal(0, 1.5, (JOINT_COUNT, 3)))
    reference = rotation.from_rotation_vector(random.normal(0, 0.3, (JOINT_COUNT, 3)))
    offsets, turned = FIGURE.offsets.copy(), reference.copy()
    for joint in range(JOINT_COUNT):
        parent = PARENTS[joint]
        turned[joint] = rotation.multiply(reference[joint], frames[joint])
        if joint > 0:
            offsets[joint] = rotation.rotate(rotation.conjugate(frames[parent]), FIGURE.offsets[joint])
            turned[joint] = rotation.multiply(rotation.conjugate(frames[parent]), turned[joint])
    tips = rotation.rotate(rotation.conjugate(frames), FIGURE.tips)
    original, other = channel_weights(FIGURE, reference), channel_weights(Figure(offsets, tips), turned)
    np.testing.assert_allclose(other[0], original[0])
    np.testing.assert_allclose(other[1:] @ rotation.to_matrix(rotation.conjugate(frames)), original[1:], atol=1e-9)


def test_bone_of_zero_length_has_finite_weights() -> None:
    offsets = FIGURE.offsets.copy()
    offsets[JOINT_INDEX["l_wrist"]] = 0
    assert np.isfinite(channel_weights(Figure(offsets, FIGURE.tips), REST_POSE)).all()
