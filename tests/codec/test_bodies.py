from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import bodies, transform
from bunraku.codec.bodies import BELOW, BELOW_COUNT, MOVED, MOVED_COUNT, Body
from bunraku.codec.decode import reconstruct
from bunraku.codec.track import plan
from bunraku.motion import rotation
from bunraku.motion.skeleton import INDEX, JOINT_COUNT, TIPS, points, world
from tests.vectors.blocks import wandering_motion

UNIT = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)


@given(UNIT, UNIT, UNIT)
def test_rotations_are_those_of_the_motion_room(a: rotation.Array, b: rotation.Array, v: rotation.Array) -> None:
    p, q, out, back = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(3)
    bodies.exponential(a, p)
    bodies.exponential(b, q)
    np.testing.assert_allclose(p, rotation.from_rotation_vector(a), atol=1e-12)
    bodies.multiply(p, q, out)
    np.testing.assert_allclose(out, rotation.multiply(p, q), atol=1e-12)
    bodies.multiply_back(p, out, out)
    np.testing.assert_allclose(out, q, atol=1e-12)
    bodies.rotate(p, v, back)
    np.testing.assert_allclose(back, rotation.rotate(p, v), atol=1e-12)
    bodies.logarithm(q, back)
    np.testing.assert_allclose(back, rotation.to_rotation_vector(q), atol=1e-9)


def test_what_turns_and_moves_with_a_joint() -> None:
    knee = INDEX["l_knee"]
    assert set(BELOW[knee][: BELOW_COUNT[knee]]) == {INDEX[n] for n in ("l_knee", "l_ankle", "l_midtarsal")}
    moved = set(MOVED[knee][: MOVED_COUNT[knee]])
    assert moved == {INDEX["l_ankle"], INDEX["l_midtarsal"], JOINT_COUNT + TIPS.index(INDEX["l_midtarsal"])}
    assert MOVED_COUNT[0] == JOINT_COUNT + len(TIPS) - 1


def test_a_block_s_pose_is_that_of_the_decoder() -> None:
    track = plan(wandering_motion(1.0, 30.0, 4))
    q = np.random.default_rng(5).integers(-4, 5, (19, 3, 8))
    weight = track.weights
    body = Body(
        track.figure.offsets,
        track.figure.tips,
        weight,
        track.unweights,
        track.reference_rotations(-9),
    )
    basis = transform.basis(30, 8, np.arange(30.0))
    vectors, orientation, placed = np.zeros((18, 30, 3)), np.zeros((18, 30, 4)), np.zeros((23, 30, 3))
    bodies.pose(body, q, 0.01, np.ascontiguousarray(basis.T), vectors, orientation, placed)
    tracks = transform.inverse(np.linalg.inv(weight) @ (reconstruct(q) * 0.01), 30, np.arange(30.0))
    rotations = rotation.multiply(
        np.broadcast_to(body.reference, (30, 18, 4)), rotation.from_rotation_vector(tracks[:, 1:])
    )
    np.testing.assert_allclose(placed.transpose(1, 0, 2), points(track.figure, tracks[:, 0], rotations), atol=1e-10)
    turned = world(track.figure, tracks[:, 0], rotations)[1]
    np.testing.assert_allclose(orientation.transpose(1, 0, 2), turned, atol=1e-10)
