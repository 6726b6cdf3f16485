from __future__ import annotations

import numpy as np

from bunraku.codec import prior
from bunraku.codec._kernels import closed_loop
from bunraku.codec.block_encoder import BlockEncoder
from bunraku.codec.motion_track import plan_motion_track
from tests.vectors.blocks import random_motion

MOTION = random_motion(1.0, 30.0, 3)
TRACK = plan_motion_track(MOTION)
ENCODER = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior())


def test_finer_step_lowers_the_error() -> None:
    errors = [ENCODER.encode_block(0, step).errors_mm.mean() for step in (40, 80, 120, 160, 200)]
    assert errors == sorted(errors)
    assert errors[0] < 0.05


def test_errors_do_not_add_up_along_a_limb() -> None:
    """In a closed loop a wrist is hardly further off than an elbow; otherwise every joint above adds its own error."""
    error = ENCODER.encode_block(0, 140).errors_mm.mean(axis=1)
    elbows, wrists = error[[13, 16]].mean(), error[[14, 17]].mean()
    assert wrists < 1.5 * elbows


def test_symmetric_system_is_solved() -> None:
    random = np.random.default_rng(1)
    for _ in range(50):
        half = random.normal(size=(3, 3))
        a, b, out = half @ half.T + 0.1 * np.eye(3), random.normal(size=3), np.zeros(3)
        closed_loop._solve_symmetric(a, b, out)
        np.testing.assert_allclose(a @ out, b, atol=1e-9)
