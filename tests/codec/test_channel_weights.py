from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.channel_weights import channel_weights
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, PARENTS, Figure, standard_figure

FIGURE = standard_figure()
REST_POSE = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))


def squared_weights(found: rotation.Array) -> rotation.Array:
    return found.transpose(0, 2, 1) @ found


def test_weights_fall_along_a_limb_and_are_least_along_a_bone() -> None:
    found = channel_weights(FIGURE, REST_POSE)
    chain = [np.linalg.norm(found[1 + JOINT_INDEX[name]]) for name in ("l_hip", "l_knee", "l_ankle", "l_midtarsal")]
    assert chain == sorted(chain, reverse=True)
    assert (np.linalg.svd(found, compute_uv=False) > 0.05).all()
    for name in ("l_knee", "r_elbow", "skullbase"):
        rows = np.linalg.norm(found[1 + JOINT_INDEX[name]], axis=1)
        # the second axis is the bone: turning about it moves only what is beside it
        assert rows[1] < 0.5 * min(rows[0], rows[2])


@pytest.mark.parametrize("thigh", [np.zeros(3), np.array([0.4, 0.2, 1.1]), np.array([-1.3, 0.0, 0.2])])
def test_a_bent_knee_s_first_axis_is_its_hinge(thigh: rotation.Array) -> None:
    bent, hip, knee = REST_POSE.copy(), JOINT_INDEX["l_hip"], JOINT_INDEX["l_knee"]
    bent[hip], bent[knee] = rotation.from_rotation_vector(np.array([thigh, [0.8, 0.0, 0.3]]))
    before = rotation.rotate(rotation.conjugate(bent[knee]), FIGURE.offsets[knee])
    hinge = np.cross(before, FIGURE.offsets[JOINT_INDEX["l_ankle"]])
    first = channel_weights(FIGURE, bent)[1 + knee] @ hinge
    assert abs(first[0]) > 20 * max(abs(first[1]), abs(first[2]))


@pytest.mark.parametrize("seed", range(6))
def test_the_axes_are_the_dancer_s_whatever_frames_the_bones_have(seed: int) -> None:
    """A skeleton with every bone's frame turned, and rotations to match, is coded with the same numbers."""
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
    plain, other = channel_weights(FIGURE, reference), channel_weights(Figure(offsets, tips), turned)
    np.testing.assert_allclose(other[0], plain[0])
    np.testing.assert_allclose(other[1:] @ rotation.to_matrix(rotation.conjugate(frames)), plain[1:], atol=1e-9)


def test_a_limb_of_no_length_has_the_dancer_s_axes() -> None:
    offsets = FIGURE.offsets.copy()
    offsets[JOINT_INDEX["l_wrist"]] = 0
    assert np.isfinite(channel_weights(Figure(offsets, FIGURE.tips), REST_POSE)).all()
