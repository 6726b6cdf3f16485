"""Heads and quantised coefficients of blocks to bytes and back (SPEC.md, Motion block)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import MAGNITUDE_LEVELS, MAX_BLOCK_FRAMES, IntArray, Prior
from bunraku.motion.skeleton import CHANNEL_COUNT

MAX_BLOCK_BYTES = 65_536
SCENE_CHANNEL_COUNT = 3
"""Channels of a camera's or a light's block, the last with one axis only; a motion's has 19."""


@dataclass(frozen=True, slots=True)
class BlockHeader:
    """What stands before the coefficients: `frames`, the `step` index (0..255), and `heading`, the turn about y that
    the root's rotations are relative to, in 1/64 of a whole one (-32..31)."""

    frames: int
    step: int
    heading: int


@cache
def _load_entropy_coder() -> ModuleType:

    from bunraku.codec import entropy_coder

    return entropy_coder


def warm_up(prior: Prior) -> None:
    """Load the compiled code, or compile it where that was never done: seconds that no one should wait for later."""
    ones = np.ones((CHANNEL_COUNT, 3, 2), dtype=np.int64)
    decode_coefficients(prior, encode_coefficients(prior, BlockHeader(2, 100, 0), ones, 2, 30.0), 2, 30.0)


def duration_level(frames: int, fps: float) -> int:
    """Level of a block's duration in sixteenths of a second: a feature of its contexts."""
    return int(MAGNITUDE_LEVELS[min(int(16 * frames / fps + 0.5), 4095)])


def encode_coefficients(prior: Prior, header: BlockHeader, q: IntArray, nominal_frames: int, fps: float) -> bytes:
    """Bytes of a block of `fps` frames a second with coefficients `q` (19, 3, K), K <= frames; zero frequencies at
    the end cost nothing, nor does the number of frames where it is `usual`. `q` (3, 3, K) are a camera's or light's:
    such a block says neither the head's heading nor the last channel's second and third axis, zeros.

    Raises ValueError for a coefficient or block that is too large.
    """
    used = np.flatnonzero(q.any(axis=(0, 1)))
    count = int(used[-1]) + 1 if len(used) else 0
    q = np.ascontiguousarray(q[:, :, :count], dtype=np.int64)
    entropy_coder = _load_entropy_coder()
    out = entropy_coder.allocate_output(q)
    channels = SCENE_CHANNEL_COUNT if len(q) == SCENE_CHANNEL_COUNT else CHANNEL_COUNT if q[2:].any() else 2
    numbers = np.array([header.frames, header.step, header.heading, count, channels], dtype=np.int64)
    length = entropy_coder.encode_block(prior, q, numbers, nominal_frames, duration_level(header.frames, fps), out)
    if not 0 <= length <= MAX_BLOCK_BYTES:
        raise ValueError("a coefficient is too large to be coded: the step is too fine for this motion")
    written: bytes = out[1:length].tobytes()
    return written.rstrip(b"\0")


def decode_coefficients(
    prior: Prior, data: bytes, nominal_frames: int, fps: float, channels: int = CHANNEL_COUNT
) -> tuple[BlockHeader, IntArray]:
    """Head and coefficients (`channels`, 3, K) of a block; raises `DamagedBlock`."""
    if len(data) > MAX_BLOCK_BYTES:
        raise DamagedBlock(f"a block has at most {MAX_BLOCK_BYTES} bytes, not {len(data)}")
    entropy_coder = _load_entropy_coder()
    numbers = np.array([0, 0, 0, 0, channels], dtype=np.int64)
    octets = np.array(bytearray(data), dtype=np.uint8)
    if not entropy_coder.decode_header(octets, nominal_frames, numbers):
        raise DamagedBlock(
            f"block says {numbers[0]} frames and {numbers[3]} frequencies; 1..{MAX_BLOCK_FRAMES} and no more are allowed"
        )
    frames, step, heading, count = map(int, numbers[:4])
    q = np.zeros((channels, 3, count), dtype=np.int64)
    if not entropy_coder.decode_block(prior, octets, q, numbers, nominal_frames, duration_level(frames, fps)):
        raise DamagedBlock(f"block holds a number longer than {entropy_coder.MAX_ESCAPE_BITS} bits")
    return BlockHeader(frames, step, heading), q
