from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import prior
from bunraku.codec.block_encoder import MEAN_ERROR_REFINEMENT, BlockEncoder
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_decoder import decode_motion_block, reconstruct
from bunraku.codec.motion_track import plan_motion_track
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import joint_and_tip_positions
from tests.vectors.blocks import random_motion

MOTION = random_motion(2.0, 30.0, 11)
TRACK = plan_motion_track(MOTION)
BLOCK = BlockEncoder(TRACK, MOTION, prior.load_shipped_prior()).encode_block(0, 96, MEAN_ERROR_REFINEMENT).data


def source_points(instants: Array) -> Array:
    """Return the true points between frames, from the same motion at a frame rate 8 times higher."""
    oversampled = random_motion(2.0, 240.0, 11)
    index = np.round(instants * 8).astype(int)
    return joint_and_tip_positions(TRACK.figure, oversampled.root[index], oversampled.rotations[index])


def test_block_can_be_evaluated_between_frames() -> None:
    instants = np.arange(16, 216) / 8.0
    root, rotations = decode_motion_block(TRACK, BLOCK).pose_at(instants)
    error = np.linalg.norm(joint_and_tip_positions(TRACK.figure, root, rotations) - source_points(instants), axis=-1)
    assert error.mean() < 0.003
    assert np.allclose(np.linalg.norm(rotations, axis=-1), 1)


def test_reconstruction_is_biased_towards_zero() -> None:
    np.testing.assert_allclose(reconstruct(np.array([-5, -1, 0, 1, 2])), [-4.97, -0.94, 0, 0.94, 1.97])


@given(st.binary(max_size=400))
def test_arbitrary_bytes_are_decoded_or_refused(data: bytes) -> None:
    try:
        block = decode_motion_block(TRACK, data)
    except DamagedBlock:
        return
    assert 1 <= block.frames <= 512


@given(st.integers(0, len(BLOCK) * 8 - 1), st.integers(0, len(BLOCK)))
def test_damaged_block_is_decoded_or_refused(bit: int, length: int) -> None:
    damaged = bytearray(BLOCK)
    damaged[bit // 8] ^= 1 << bit % 8
    for data in (bytes(damaged), BLOCK[:length]):
        try:
            block = decode_motion_block(TRACK, data)
        except DamagedBlock:
            continue
        root, rotations = block.pose_at(0.0)
        assert root.shape == (1, 3)
        assert rotations.shape == (1, 18, 4)
