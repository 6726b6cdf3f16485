"""Quantised coefficients of one block to bytes and back (SPEC.md, Motion block: Order, Symbol, Exp-Golomb, Model)."""

from __future__ import annotations

from functools import cache
from types import ModuleType

import numpy as np
import numpy.typing as npt

from bunraku.codec.errors import DamagedBlock
from bunraku.motion.skeleton import CHANNEL_COUNT

Integers = npt.NDArray[np.int64]


@cache
def _kernels() -> ModuleType:
    from bunraku.codec import kernels

    return kernels


def warm() -> None:
    """Load the compiled code, or compile it where that was never done: seconds that no one should wait for later."""
    decode(encode(np.ones((CHANNEL_COUNT, 3, 2), dtype=np.int64)), 2)


def encode(q: Integers) -> bytes:
    """Bytes of the coefficients `q` (19, 3, K), K < 1024, |q| < 2^23; zero frequencies at the end cost nothing.

    Raises ValueError for a larger coefficient.
    """
    used = np.flatnonzero(q.any(axis=(0, 1)))
    q = np.ascontiguousarray(q[:, :, : int(used[-1]) + 1 if len(used) else 0], dtype=np.int64)
    out = np.zeros(64 + q.size * 8, dtype=np.uint8)
    length = _kernels().encode(q, out)
    if length < 0:
        raise ValueError("a coefficient is too large to be coded: the step is too fine for this motion")
    return out[1:length].tobytes().rstrip(b"\0")


def decode(data: bytes, frames: int) -> Integers:
    """The coefficients (19, 3, K) of a block of `frames` frames; raises `DamagedBlock`."""
    q = np.zeros((CHANNEL_COUNT, 3, frames), dtype=np.int64)
    count = _kernels().decode(np.array(bytearray(data), dtype=np.uint8), q)
    if count < 0:
        raise DamagedBlock("block holds a number longer than 24 bits")
    if count > frames:
        raise DamagedBlock(f"block says {count} frequencies for {frames} frames")
    return q[:, :, :count]
