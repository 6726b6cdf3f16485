"""Search for the quantiser step of channels whose error is measured in themselves: scenes and extensions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.codec import coefficients, transform
from bunraku.codec.channel_layout import ChannelLayout
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.motion_decoder import reconstruct
from bunraku.codec.motion_track import step_size
from bunraku.codec.prior import IntArray, Prior
from bunraku.codec.timing import Timing
from bunraku.motion.rotation import Array

_MIN_STEP, _MAX_STEP = 0, 255
_ROUNDING_OFFSETS = 0.5, 0.4, 0.3, 0.2
"""Offsets that are added to a magnitude before it is rounded down. A smaller one gives more zeros at a finer step."""
_COARSE_STEP_STRIDE = 16
"""Distance of the step indices that are tried first; the indices between two of them follow."""
_EXTRA_STEPS = 8
"""Further step indices that are tried."""
_BOUND_MARGIN = 1 - 1e-6


def encode_channels(
    truth: Array, error_bound_mm: float, timing: Timing, layout: ChannelLayout, prior: Prior
) -> list[bytes]:
    """Return blocks of weighted channels (n, C, 3), in metres, of which none is more than the bound off in any frame.

    There is at most one for each rounding offset; none if even the finest step does not meet the bound.
    """
    blocks = []
    for rounding_offset in _ROUNDING_OFFSETS:
        search = _StepSearch(truth, rounding_offset)
        step = search.find_coarsest_step(error_bound_mm)
        if step is not None:
            header, q = BlockHeader(len(truth), step, 0), search.quantise(step)
            blocks.append(coefficients.encode_coefficients(prior, header, q, timing.block_frames, timing.fps, layout))
    return blocks


class _StepSearch:
    """Search for the quantiser step of one block's channels (n, C, 3) with one rounding offset."""

    def __init__(self, truth: Array, rounding_offset: float) -> None:
        self._truth, self._rounding_offset, self._frames = truth, rounding_offset, len(truth)
        self._spectrum = transform.forward_dct(truth)
        self._basis = transform.cosine_basis(self._frames, self._frames, np.arange(self._frames, dtype=np.float64))

    def quantise(self, step: int) -> IntArray:
        """Return the coefficients (C, 3, n) at one step index."""
        q: IntArray = self._quantise_steps(np.array([step]))[0]
        return q

    def find_coarsest_step(self, error_bound_mm: float) -> int | None:
        """Return the coarsest step index found that meets a bound, or None.

        Errors grow with the step, but not monotonically, so a few steps beyond the first failure are tried too.
        """
        coarse = np.arange(_MIN_STEP, _MAX_STEP + 1, _COARSE_STEP_STRIDE)
        valid = self._meets_bound(coarse, error_bound_mm)
        first_failure = int(np.argmin(valid)) if not valid.all() else len(coarse)
        begin = int(coarse[first_failure - 1]) if first_failure else _MIN_STEP
        fine = np.arange(begin, min(begin + _COARSE_STEP_STRIDE + _EXTRA_STEPS, _MAX_STEP) + 1)
        valid_steps = fine[self._meets_bound(fine, error_bound_mm)]
        return int(valid_steps[-1]) if len(valid_steps) else None

    def _step_sizes(self, steps: IntArray) -> Array:
        return np.array([step_size(int(step), self._frames) for step in steps])[:, None, None, None]

    def _quantise_steps(self, steps: IntArray) -> IntArray:
        magnitudes = np.floor(np.abs(self._spectrum) / self._step_sizes(steps) + self._rounding_offset)
        q: IntArray = (np.sign(self._spectrum) * magnitudes).astype(np.int64)
        return q

    def _meets_bound(self, steps: IntArray, error_bound_mm: float) -> npt.NDArray[np.bool_]:
        """Return for each step whether no channel is more than `error_bound_mm` off at any frame."""
        decoded = (reconstruct(self._quantise_steps(steps)) * self._step_sizes(steps)) @ self._basis.T
        error = np.linalg.norm(np.moveaxis(decoded, -1, 1) - self._truth, axis=-1)
        valid: npt.NDArray[np.bool_] = error.max(axis=(1, 2)) * 1e3 <= error_bound_mm * _BOUND_MARGIN
        return valid
