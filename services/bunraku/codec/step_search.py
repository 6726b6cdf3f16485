"""Search for the quantiser step with which a block meets an error bound in the fewest bytes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

import numpy as np

from bunraku.motion.rotation import Array

MIN_STEP, MAX_STEP = 0, 255

_BOUND_MARGIN = 1 - 1e-6
_STEPS_PER_OCTAVE = 16
_AIMED_SHARE = 0.97
"""Share of the bound that the next step is chosen for."""
_MAX_MOVE = 48
_LIVE_MIN_ERROR_SHARE = 0.6
"""A search for any valid step accepts a block whose largest error is at least this share of the bound."""
_FALLBACK_MOVE = 4
_STRIDE = 6
"""Smallest move of the search for the cheapest step."""


class Candidate(Protocol):
    """A block encoded at some step."""

    @property
    def errors_mm(self) -> Array:
        """Errors of all points and frames in mm."""

    @property
    def data(self) -> bytes:
        """Bytes of the block."""


Block = TypeVar("Block", bound=Candidate)


class StepSearch(Generic[Block]):
    """Search among the encodings of one block. `encode` encodes it at a step index."""

    def __init__(self, encode: Callable[[int], Block], error_bound_mm: float) -> None:
        self._encode = encode
        self._error_bound_mm = error_bound_mm
        self._candidates: dict[int, Block] = {}

    def find_valid(self, initial_step: int) -> Block | None:
        """Return a block within the bound after few encodings; None if the finest step exceeds it."""
        max_error = self._max_error(initial_step)
        if not _LIVE_MIN_ERROR_SHARE * self._error_bound_mm < max_error <= self._error_bound_mm:
            move = self._move_to_bound(initial_step)
            if abs(move) > 1 or not self._meets_bound(initial_step):
                self._max_error(_limit(initial_step + (move or -1)))
        step = min(self._candidates)
        while not any(map(self._meets_bound, list(self._candidates))):
            if step == MIN_STEP:
                return None
            step = _limit(step - _FALLBACK_MOVE)
            self._max_error(step)
        return self._smallest()

    def find_cheapest(self, initial_step: int) -> Block | None:
        """Return the smallest block found within the bound; None if the finest step exceeds it."""
        coarsest_valid, finest_invalid = MIN_STEP - 1, MAX_STEP + 1
        step = initial_step
        while coarsest_valid < step < finest_invalid:
            if self._meets_bound(step):
                coarsest_valid = step
                step = _limit(step + max(self._move_to_bound(step), _STRIDE))
            else:
                finest_invalid = step
                step = _limit(step + min(self._move_to_bound(step), -_STRIDE))
        if coarsest_valid < MIN_STEP:
            return None
        self._max_error(_limit(coarsest_valid + _STRIDE // 2))
        return self._smallest()

    def _max_error(self, step: int) -> float:
        if step not in self._candidates:
            self._candidates[step] = self._encode(step)
        return float(self._candidates[step].errors_mm.max())

    def _meets_bound(self, step: int) -> bool:
        return self._max_error(step) <= self._error_bound_mm * _BOUND_MARGIN

    def _move_to_bound(self, step: int) -> int:
        """Return the move after which the largest error would be near the bound, if it grew as the step does."""
        octaves = np.log2(self._error_bound_mm * _AIMED_SHARE / max(self._max_error(step), 1e-9))
        return int(np.clip(np.round(_STEPS_PER_OCTAVE * octaves), -_MAX_MOVE, _MAX_MOVE))

    def _smallest(self) -> Block:
        valid = [self._candidates[step] for step in self._candidates if self._meets_bound(step)]
        return min(valid, key=lambda block: len(block.data))


def _limit(step: int) -> int:
    return min(max(step, MIN_STEP), MAX_STEP)
