from __future__ import annotations

import numpy as np

from bunraku.codec import bodies, prior, refine, transform
from bunraku.codec.search import BlockEncoder
from bunraku.codec.track import plan
from bunraku.motion.skeleton import points
from tests.vectors.blocks import wandering_motion

MOTION = wandering_motion(1.0, 30.0, 3)
TRACK = plan(MOTION)


def test_slopes_are_those_of_the_error() -> None:
    """The analytic derivative by one weighted value against a difference of the whole pose's error."""
    weight = TRACK.weights
    body = bodies.Body(
        TRACK.figure.offsets,
        TRACK.figure.tips,
        weight,
        TRACK.unweights,
        TRACK.reference_rotations(9),
    )
    basis = np.ascontiguousarray(transform.basis(30, 6, np.arange(30.0)).T)
    q = np.random.default_rng(2).integers(-9, 10, (19, 3, 6))
    truth = points(MOTION.figure, MOTION.root, MOTION.rotations).transpose(1, 0, 2)

    def posed(unit: bodies.Array) -> tuple[bodies.Array, bodies.Array, bodies.Array]:
        vectors, orientation, placed = np.zeros((18, 30, 3)), np.zeros((18, 30, 4)), np.zeros((23, 30, 3))
        placed[0] = bodies.values(q, 0, 0.02, body.unweight[0], basis)
        for joint in range(18):
            vectors[joint] = bodies.values(q, joint + 1, 0.02, body.unweight[joint + 1], basis)
            vectors[joint] += unit if joint == 13 else 0
            bodies.turn(body, joint, vectors[joint], orientation)
            bodies.place_children(body, joint, orientation, placed)
        return vectors, orientation, placed

    vectors, orientation, placed = posed(np.zeros(3))
    axes, slope, bend = np.zeros((30, 3)), np.zeros(30), np.zeros(30)
    refine._axes(body, 13, 1, vectors[13], orientation, axes)
    still = np.zeros((18, 30, 3))
    refine._slopes(13, axes, placed, placed - truth, still, np.ones((23, 30)), slope, bend)
    tiny = 1e-5
    more, less = (posed(by * tiny * body.unweight[14][:, 1])[2] for by in (1, -1))
    difference = (((more - truth) ** 2).sum((0, 2)) - ((less - truth) ** 2).sum((0, 2))) / (4 * tiny)
    np.testing.assert_allclose(slope, difference, rtol=1e-4, atol=1e-6)


def test_a_sweep_never_makes_it_dearer() -> None:
    encoder = BlockEncoder(TRACK, MOTION, prior.shipped())
    first, refined = encoder.block(0, 120, "first"), encoder.block(0, 120, "mean")
    assert len(refined.data) < len(first.data)
    assert refined.error.mean() < 1.5 * first.error.mean()
