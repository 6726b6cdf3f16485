from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import forward_kinematics, transform
from bunraku.codec.forward_kinematics import (
    DESCENDANT_COUNT,
    DESCENDANTS,
    MOVED_POINT_COUNT,
    MOVED_POINTS,
    KinematicChain,
)
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion import rotation
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, TIP_JOINTS, joint_and_tip_positions, world_transforms
from tests.vectors.blocks import random_motion

VECTORS = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)


@given(VECTORS, VECTORS, VECTORS)
def test_rotations_are_those_of_the_motion_room(a: rotation.Array, b: rotation.Array, v: rotation.Array) -> None:
    p, q, out, back = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(3)
    forward_kinematics.from_rotation_vector(a, p)
    forward_kinematics.from_rotation_vector(b, q)
    np.testing.assert_allclose(p, rotation.from_rotation_vector(a), atol=1e-12)
    forward_kinematics.multiply(p, q, out)
    np.testing.assert_allclose(out, rotation.multiply(p, q), atol=1e-12)
    forward_kinematics.multiply_inverse(p, out, out)
    np.testing.assert_allclose(out, q, atol=1e-12)
    forward_kinematics.rotate(p, v, back)
    np.testing.assert_allclose(back, rotation.rotate(p, v), atol=1e-12)
    forward_kinematics.to_rotation_vector(q, back)
    np.testing.assert_allclose(back, rotation.to_rotation_vector(q), atol=1e-9)


def test_what_turns_and_moves_with_a_joint() -> None:
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


def test_a_block_s_pose_is_that_of_the_decoder() -> None:
    track = plan_motion_track(random_motion(1.0, 30.0, 4))
    q = np.random.default_rng(5).integers(-4, 5, (19, 3, 8))
    weight = track.weights
    body = KinematicChain(
        track.figure.offsets,
        track.figure.tips,
        weight,
        track.inverse_weights,
        track.reference_rotations(-9),
    )
    basis = transform.cosine_basis(30, 8, np.arange(30.0))
    vectors, orientation, placed = np.zeros((18, 30, 3)), np.zeros((18, 30, 4)), np.zeros((23, 30, 3))
    forward_kinematics.compute_pose(body, q, 0.01, np.ascontiguousarray(basis.T), vectors, orientation, placed)
    tracks = transform.inverse_dct(np.linalg.inv(weight) @ (reconstruct(q) * 0.01), 30, np.arange(30.0))
    rotations = rotation.multiply(
        np.broadcast_to(body.reference, (30, 18, 4)), rotation.from_rotation_vector(tracks[:, 1:])
    )
    np.testing.assert_allclose(
        placed.transpose(1, 0, 2), joint_and_tip_positions(track.figure, tracks[:, 0], rotations), atol=1e-10
    )
    turned = world_transforms(track.figure, tracks[:, 0], rotations)[1]
    np.testing.assert_allclose(orientation.transpose(1, 0, 2), turned, atol=1e-10)
