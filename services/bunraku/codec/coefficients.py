"""Block bytes: header and quantised coefficients to bytes and back (proto/codec.md, 2.8 and 2.9)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bunraku.codec.channel_layout import MOTION_LAYOUT, ChannelLayout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.prior import MAGNITUDE_LEVELS, MAX_BLOCK_FRAMES, IntArray, Prior
from bunraku.kernels import load_kernels
from bunraku.motion.skeleton import CHANNEL_COUNT

MAX_BLOCK_BYTES = 65_536


@dataclass(frozen=True, slots=True)
class BlockHeader:
    """Header of a block: frames, step index (0..255), and heading.

    The heading (-32..31) is the rotation about y, in 1/64 of a turn, that the root's rotations are relative to.
    """

    frames: int
    step: int
    heading: int


def warm_up(prior: Prior) -> None:
    """Load the compiled code, or compile it if it is not cached, which takes seconds."""
    ones = np.ones((CHANNEL_COUNT, 3, 2), dtype=np.int64)
    decode_coefficients(prior, encode_coefficients(prior, BlockHeader(2, 100, 0), ones, 2, 30.0), 2, 30.0)


def duration_level(frames: int, fps: float) -> int:
    """Return the level of a block's duration in sixteenths of a second, a feature of the context model."""
    return int(MAGNITUDE_LEVELS[min(int(16 * frames / fps + 0.5), 4095)])


def encode_coefficients(
    prior: Prior,
    header: BlockHeader,
    q: IntArray,
    nominal_frames: int,
    fps: float,
    layout: ChannelLayout = MOTION_LAYOUT,
) -> bytes:
    """Encode one block.

    Args:
        prior: Prior of the context model; the decoder needs the same.
        header: Header of the block; its heading is encoded only if the layout has one.
        q: Coefficients (C, 3, K) of the layout's channels, K <= frames. Trailing frequencies of zeros are free. Axes
            that the layout does not code must be zero.
        nominal_frames: The track's `block_frames`; a block of this length does not spend bits on its length.
        fps: Frames per second.
        layout: Channels of the block.

    Raises:
        ValueError: A coefficient or the block is too large.
    """
    used = np.flatnonzero(q.any(axis=(0, 1)))
    frequencies = int(used[-1]) + 1 if len(used) else 0
    q = np.ascontiguousarray(q[:, :, :frequencies], dtype=np.int64)
    kernels = load_kernels("codec")
    out = kernels.allocate_output(q)
    channels = 2 if layout.heading and not q[2:].any() else len(q)
    numbers = np.array([header.frames, header.step, header.heading, frequencies, channels], dtype=np.int64)
    length = kernels.encode_block(prior, layout, q, numbers, nominal_frames, duration_level(header.frames, fps), out)
    if not 0 <= length <= MAX_BLOCK_BYTES:
        raise ValueError("Cannot encode a block: a coefficient is too large. Use a coarser quantiser step.")
    written: bytes = out[1:length].tobytes()
    return written.rstrip(b"\0")


def decode_coefficients(
    prior: Prior, data: bytes, nominal_frames: int, fps: float, layout: ChannelLayout = MOTION_LAYOUT
) -> tuple[BlockHeader, IntArray]:
    """Decode the header and the coefficients (C, 3, K) of a block. Raises `DamagedBlock`."""
    if len(data) > MAX_BLOCK_BYTES:
        raise DamagedBlock(f"Invalid block: {len(data)} bytes, at most {MAX_BLOCK_BYTES} are allowed.")
    kernels = load_kernels("codec")
    channels = len(layout.axes)
    numbers = np.array([0, 0, 0, 0, channels], dtype=np.int64)
    octets = np.array(bytearray(data), dtype=np.uint8)
    if not kernels.decode_header(octets, layout, nominal_frames, numbers):
        raise DamagedBlock(
            f"Invalid block: its header has {numbers[0]} frames and {numbers[3]} frequencies, expected "
            f"1..{MAX_BLOCK_FRAMES} frames and at most as many frequencies."
        )
    frames, step, heading, frequencies = map(int, numbers[:4])
    q = np.zeros((channels, 3, frequencies), dtype=np.int64)
    if not kernels.decode_block(prior, layout, octets, q, numbers, nominal_frames, duration_level(frames, fps)):
        raise DamagedBlock(f"Invalid block: an escape has {kernels.MAX_ESCAPE_BITS} or more unary bits.")
    return BlockHeader(frames, step, heading), q
