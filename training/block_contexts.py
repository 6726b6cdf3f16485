"""Contexts of coefficients for the study of the limit: signed neighbours and the previous block.

The shipped context model sees magnitudes only, and nothing of other blocks. A context here is the signed logarithm of
a coefficient that a decoder has when it decodes the next one, and the magnitude of that logarithm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.codec.channel_layout import GRANDPARENT, MIRROR, MOTION_LAYOUT, NONE, PARENT
from bunraku.codec.prior import IntArray
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import CHANNEL_COUNT

Contexts = npt.NDArray[np.float16]

NEIGHBOUR_COUNT = 60
"""Signed neighbours of a coefficient in its block."""
PREVIOUS_COUNT = 5
"""Signed contexts from the previous block."""
CONTEXT_COUNT = 2 * (NEIGHBOUR_COUNT + PREVIOUS_COUNT)
"""Contexts of a coefficient: the first `2 * NEIGHBOUR_COUNT` are of its own block."""
_NO_CHANNEL = np.zeros((3, 0))


class CodedBlock(NamedTuple):
    """Coefficients (19, 3, K) of a block, and its step index."""

    q: IntArray
    step: int


def collect_contexts(block: CodedBlock, previous: CodedBlock | None) -> Contexts:
    """Return the contexts (N, CONTEXT_COUNT) of all coefficients of a block in coding order.

    The neighbours come first, then their magnitudes, then the contexts from the previous block (zeros without one) and
    their magnitudes.
    """
    frequencies = block.q.shape[2]
    signed = np.empty((CHANNEL_COUNT, frequencies, 3, NEIGHBOUR_COUNT + PREVIOUS_COUNT))
    levels = _signed_level(block.q)
    earlier = np.zeros((CHANNEL_COUNT, 3, frequencies, PREVIOUS_COUNT))
    if previous is not None:
        earlier = _previous_contexts(block, previous)
    for channel in range(CHANNEL_COUNT):
        rows = _channel_neighbours(levels, channel)
        signed[channel, :, :, :NEIGHBOUR_COUNT] = rows.transpose(2, 1, 0)
        signed[channel, :, :, NEIGHBOUR_COUNT:] = earlier[channel].transpose(1, 0, 2)
    neighbours, from_previous = np.split(signed.reshape(-1, signed.shape[-1]), [NEIGHBOUR_COUNT], axis=1)
    return np.concatenate(
        [neighbours, np.abs(neighbours), from_previous, np.abs(from_previous)],
        axis=1,
        dtype=np.float16,
        casting="same_kind",
    )


def _signed_level(values: Array | IntArray) -> Array:
    """Return sign(x) log2(1 + |x|)."""
    levels: Array = np.sign(values) * np.log2(1.0 + np.abs(values))
    return levels


def _shift(levels: Array, offset: int, frequencies: int) -> Array:
    """Return the levels (3, K) of the frequency `offset` above each; zeros beyond the block or without a channel."""
    shifted = np.zeros((3, frequencies))
    if levels.shape[1] > abs(offset):
        if offset >= 0:
            shifted[:, : frequencies - offset] = levels[:, offset:]
        else:
            shifted[:, -offset:] = levels[:, :offset]
    return shifted


def _channel_neighbours(levels: Array, channel: int) -> Array:
    """Return the neighbours (NEIGHBOUR_COUNT, 3, K) of the coefficients of one channel."""
    frequencies = levels.shape[2]
    relatives = MOTION_LAYOUT.relatives

    def of(relative: int) -> Array:
        return levels[relative] if NONE < relative < channel else _NO_CHANNEL

    parent, mirror = int(relatives[PARENT, channel]), int(relatives[MIRROR, channel])
    mirror_parent = int(relatives[PARENT, mirror]) if mirror != NONE else NONE
    own = levels[channel]
    shared = [
        *(_shift(of(parent), offset, frequencies) for offset in (0, -1, 1, 2)),
        *(_shift(of(mirror), offset, frequencies) for offset in (0, -1, 1)),
        *(_shift(own, offset, frequencies) for offset in (-1, -2)),
        *(_shift(of(other), 0, frequencies) for other in (int(relatives[GRANDPARENT, channel]), mirror_parent)),
        *(_shift(of(other), 0, frequencies) for other in (0, 1, 2, channel - 1, channel - 2)),
    ]
    # each of the three axes sees all three axes of these
    rows = [np.broadcast_to(values[axis], (3, frequencies)) for values in shared for axis in range(3)]
    # and its own axis of these
    rows += [_shift(own, -offset, frequencies) for offset in (1, 2, 3, 4, 5, 6)]
    rows += [_shift(of(parent), 0, frequencies), _shift(of(mirror), 0, frequencies)]
    for coded in (0, 1):
        done = np.zeros((3, frequencies))
        done[coded + 1 :] = own[coded]
        rows.append(done)
    rows += [_shift(of(mirror), offset, frequencies) for offset in (-1, 1)]
    return np.stack(rows)


def _previous_contexts(block: CodedBlock, previous: CodedBlock) -> Array:
    """Return the contexts (19, 3, K, PREVIOUS_COUNT) from the previous block.

    They are its coefficients around the same frequency, the distance of its end from the sum of the lower frequencies
    of this block at its start, and a one.
    """
    frequencies = block.q.shape[2]
    ratio = 2.0 ** ((previous.step - block.step) / 16)
    before = np.zeros((CHANNEL_COUNT, 3, frequencies + 2))
    count = min(previous.q.shape[2], frequencies + 1)
    before[:, :, 1 : 1 + count] = previous.q[:, :, :count] * ratio
    end = _boundary_terms(previous.q * (-1.0) ** np.arange(previous.q.shape[2])).sum(axis=2, keepdims=True) * ratio
    terms = _boundary_terms(block.q)
    missing = end - (np.cumsum(terms, axis=2) - terms)
    levels = _signed_level(before)
    return np.stack(
        [levels[:, :, 1:-1], levels[:, :, :-2], levels[:, :, 2:], _signed_level(missing), np.ones(missing.shape)],
        axis=-1,
    )


def _boundary_terms(q: Array | IntArray) -> Array:
    """Return the contributions of coefficients to the value at the start of a block (proto/codec.md, 2.7)."""
    weights = np.full(q.shape[2], np.sqrt(2.0))
    weights[:1] = 1.0
    return np.asarray(q * weights, dtype=np.float64)
