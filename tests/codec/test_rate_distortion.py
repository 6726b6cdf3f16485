from __future__ import annotations

import numpy as np

from bunraku.codec import forward_kinematics, prior, rate_distortion, transform
from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

MOTION = random_motion(1.0, 30.0, 3)
TRACK = plan_motion_track(MOTION)


def test_slopes_are_those_of_the_error() -> None:
    """The analytic derivative by one weighted value against a difference of the whole pose's error."""
    weight = TRACK.weights
    body = forward_kinematics.KinematicChain(
        TRACK.figure.offsets,
        TRACK.figure.tips,
        weight,
        TRACK.inverse_weights,
        TRACK.reference_rotations(9),
    )
    basis = np.ascontiguousarray(transform.cosine_basis(30, 6, np.arange(30.0)).T)
    q = np.random.default_rng(2).integers(-9, 10, (19, 3, 6))
    truth = joint_and_tip_positions(MOTION.figure, MOTION.root, MOTION.rotations).transpose(1, 0, 2)

    def posed(
        unit: forward_kinematics.Array,
    ) -> tuple[forward_kinematics.Array, forward_kinematics.Array, forward_kinematics.Array]:
        vectors, orientation, placed = np.zeros((18, 30, 3)), np.zeros((18, 30, 4)), np.zeros((23, 30, 3))
        placed[0] = forward_kinematics.evaluate_channel(q, 0, 0.02, body.inverse_weight[0], basis)
        for joint in range(18):
            vectors[joint] = forward_kinematics.evaluate_channel(
                q, joint + 1, 0.02, body.inverse_weight[joint + 1], basis
            )
            vectors[joint] += unit if joint == 13 else 0
            forward_kinematics.compute_orientation(body, joint, vectors[joint], orientation)
            forward_kinematics.place_child_points(body, joint, orientation, placed)
        return vectors, orientation, placed

    vectors, orientation, placed = posed(np.zeros(3))
    axes, slope, bend = np.zeros((30, 3)), np.zeros(30), np.zeros(30)
    rate_distortion._rotation_axes(body, 13, 1, vectors[13], orientation, axes)
    still = np.zeros((18, 30, 3))
    rate_distortion._error_derivatives(13, axes, placed, placed - truth, still, np.ones((23, 30)), slope, bend)
    tiny = 1e-5
    more, less = (posed(by * tiny * body.inverse_weight[14][:, 1])[2] for by in (1, -1))
    difference = (((more - truth) ** 2).sum((0, 2)) - ((less - truth) ** 2).sum((0, 2))) / (4 * tiny)
    np.testing.assert_allclose(slope, difference, rtol=1e-4, atol=1e-6)


def test_a_sweep_never_makes_it_dearer() -> None:
    encoder = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())
    first, refined = encoder.encode_block(0, 120, "first"), encoder.encode_block(0, 120, "mean")
    assert len(refined.data) < len(first.data)
    assert refined.errors_mm.mean() < 1.5 * first.errors_mm.mean()
