from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import transform
from bunraku.codec._kernels import forward_kinematics
from bunraku.codec._kernels import rotation as compiled_rotation
from bunraku.codec._kernels.forward_kinematics import (
    DESCENDANT_COUNT,
    DESCENDANTS,
    MOVED_POINT_COUNT,
    MOVED_POINTS,
)
from bunraku.codec.block_input import KinematicChain, Quantiser
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, TIP_JOINTS, joint_and_tip_positions, world_transforms
from tests.vectors.blocks import random_motion

VECTORS = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)


@given(VECTORS, VECTORS, VECTORS)
def test_compiled_rotations_equal_those_of_the_motion_package(
    a: rotation.Array, b: rotation.Array, v: rotation.Array
) -> None:
    p, q, product, vector = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(3)
    compiled_rotation.from_rotation_vector(a, p)
    compiled_rotation.from_rotation_vector(b, q)
    np.testing.assert_allclose(p, rotation.from_rotation_vector(a), atol=1e-12)
    compiled_rotation.multiply(p, q, product)
    np.testing.assert_allclose(product, rotation.multiply(p, q), atol=1e-12)
    compiled_rotation.multiply_inverse(p, product, product)
    np.testing.assert_allclose(product, q, atol=1e-12)
    compiled_rotation.rotate(p, v, vector)
    np.testing.assert_allclose(vector, rotation.rotate(p, v), atol=1e-12)
    compiled_rotation.to_rotation_vector(q, vector)
    np.testing.assert_allclose(vector, rotation.to_rotation_vector(q), atol=1e-9)


def test_descendants_and_moved_points_of_a_knee() -> None:
    knee = JOINT_INDEX["l_knee"]
    assert set(DESCENDANTS[knee][: DESCENDANT_COUNT[knee]]) == {
        JOINT_INDEX[n] for n in ("l_knee", "l_ankle", "l_midtarsal")
    }
    moved = set(MOVED_POINTS[knee][: MOVED_POINT_COUNT[knee]])
    assert moved == {
        JOINT_INDEX["l_ankle"],
        JOINT_INDEX["l_midtarsal"],
        JOINT_COUNT + TIP_JOINTS.index(JOINT_INDEX["l_midtarsal"]),
    }
    assert MOVED_POINT_COUNT[0] == JOINT_COUNT + len(TIP_JOINTS) - 1


def test_pose_of_a_block_equals_that_of_the_decoder() -> None:
    track = plan_motion_track(random_motion(1.0, 30.0, 4))
    q = np.random.default_rng(5).integers(-4, 5, (19, 3, 8))
    chain = KinematicChain(
        track.figure.offsets,
        track.figure.tips,
        track.weights,
        track.inverse_weights,
        track.reference_rotations(-9),
    )
    quantiser = Quantiser(np.ascontiguousarray(transform.cosine_basis(30, 8, np.arange(30.0)).T), 0, 0.01)
    pose = forward_kinematics.create_pose(30)
    forward_kinematics.compute_pose(chain, quantiser, q, pose)
    tracks = transform.inverse_dct(np.linalg.inv(track.weights) @ (reconstruct(q) * 0.01), 30, np.arange(30.0))
    rotations = rotation.multiply(
        np.broadcast_to(chain.reference, (30, 18, 4)), rotation.from_rotation_vector(tracks[:, 1:])
    )
    np.testing.assert_allclose(
        pose.points.transpose(1, 0, 2), joint_and_tip_positions(track.figure, tracks[:, 0], rotations), atol=1e-10
    )
    orientation = world_transforms(track.figure, tracks[:, 0], rotations)[1]
    np.testing.assert_allclose(pose.orientation.transpose(1, 0, 2), orientation, atol=1e-10)
    np.testing.assert_array_equal(forward_kinematics.compute_points(chain, quantiser, q), pose.points)
