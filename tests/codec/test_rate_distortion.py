from __future__ import annotations

import numpy as np

from bunraku.codec import prior, transform
from bunraku.codec._kernels import forward_kinematics, rate_distortion
from bunraku.codec._kernels.forward_kinematics import Pose
from bunraku.codec._kernels.rate_distortion import AxisSlope, BlockError
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder
from bunraku.codec.block_input import KinematicChain, Quantiser
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

MOTION = random_motion(1.0, 30.0, 3)
TRACK = plan_motion_track(MOTION)


def test_derivative_equals_a_finite_difference() -> None:
    """The analytic derivative by one weighted value against a difference of the whole pose's error."""
    joint, axis = 13, 1
    chain = KinematicChain(
        TRACK.figure.offsets,
        TRACK.figure.tips,
        TRACK.weights,
        TRACK.inverse_weights,
        TRACK.reference_rotations(9),
    )
    quantiser = Quantiser(np.ascontiguousarray(transform.cosine_basis(30, 6, np.arange(30.0)).T), 0, 0.02)
    q = np.random.default_rng(2).integers(-9, 10, (19, 3, 6))
    truth = joint_and_tip_positions(MOTION.figure, MOTION.root, MOTION.rotations).transpose(1, 0, 2)

    def pose_with(offset: Array) -> Pose:
        pose = forward_kinematics.create_pose(30)
        pose.points[0] = forward_kinematics.evaluate_channel(chain, quantiser, q, 0)
        for j in range(18):
            pose.vectors[j] = forward_kinematics.evaluate_channel(chain, quantiser, q, j + 1)
            pose.vectors[j] += offset if j == joint else 0
            forward_kinematics.compute_orientation(chain, j, pose.vectors[j], pose)
            forward_kinematics.place_child_points(chain, j, pose)
        return pose

    pose = pose_with(np.zeros(3))
    slope = AxisSlope(np.zeros((30, 3)), np.zeros(30), np.zeros(30), np.zeros(30))
    error = BlockError(pose.points - truth, np.zeros((18, 30, 3)), np.ones((23, 30)))
    rate_distortion.rotation_axes(chain, joint, axis, pose, slope.axes)
    rate_distortion._error_derivatives(joint, pose.points, error, slope)
    delta = 1e-5
    above, below = (
        pose_with(sign * delta * chain.inverse_weight[joint + 1][:, axis]).points - truth for sign in (1, -1)
    )
    difference = ((above**2).sum((0, 2)) - (below**2).sum((0, 2))) / (4 * delta)
    np.testing.assert_allclose(slope.first, difference, rtol=1e-4, atol=1e-6)


def test_refinement_saves_bytes_at_a_similar_error() -> None:
    encoder = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())
    single_pass, refined = encoder.encode_block(0, 120), encoder.encode_block(0, 120, MEAN_ERROR_REFINEMENT)
    assert len(refined.data) < len(single_pass.data)
    assert refined.errors_mm.mean() < 1.5 * single_pass.errors_mm.mean()
