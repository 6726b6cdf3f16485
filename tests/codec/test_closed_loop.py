from __future__ import annotations

import numpy as np

from bunraku.codec import block_encoder, closed_loop, prior
from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.motion_track import plan_motion_track
from tests.vectors.blocks import random_motion

MOTION = random_motion(1.0, 30.0, 3)
TRACK = plan_motion_track(MOTION)
ENCODER = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())


def test_finer_steps_err_less() -> None:
    errors = [ENCODER.encode_block(0, step, "first").errors_mm.mean() for step in (40, 80, 120, 160, 200)]
    assert errors == sorted(errors)
    assert errors[0] < 0.05


def test_errors_do_not_pile_up_along_the_limbs() -> None:
    """With feedback a wrist is hardly further off than an elbow; without, every joint above adds its own."""
    error = ENCODER.encode_block(0, 140, "first").errors_mm.mean(axis=1)
    upper, lower = error[[13, 16]].mean(), error[[14, 17]].mean()
    assert lower < 1.5 * upper


def test_the_solver_solves() -> None:
    random = np.random.default_rng(1)
    for _ in range(50):
        half = random.normal(size=(3, 3))
        a, b, out = half @ half.T + 0.1 * np.eye(3), random.normal(size=3), np.zeros(3)
        closed_loop._solve_symmetric(a, b, out)
        np.testing.assert_allclose(a @ out, b, atol=1e-9)


def test_search_loads_it_only_when_asked() -> None:
    assert block_encoder._load_kernels()[2] is closed_loop
