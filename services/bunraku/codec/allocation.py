"""Which of each block's encodings to send, so that all together keep a mean error with the fewest bytes (Lagrange's
multiplier, as Shoham and Gersho 1988)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array


def select_cheapest(sizes: Array, errors: Array, error_budget: float) -> npt.NDArray[np.int64]:
    """Of each block (columns) the choice (rows), with `errors` that sum up to `budget` at most and `sizes` to near the
    least there is. Raises ValueError where even the least errors are above the budget."""
    blocks = np.arange(sizes.shape[1])
    if errors.min(axis=0).sum() > error_budget:
        raise ValueError(f"errors of {errors.min(axis=0).sum():g} at least cannot be brought to {error_budget:g}")
    picked: npt.NDArray[np.int64] = np.argmin(errors, axis=0)
    low, high = 1e-9, 1e9
    for _ in range(80):
        price = float(np.sqrt(low * high))
        choice = np.argmin(sizes + price * errors, axis=0)
        if errors[choice, blocks].sum() > error_budget:
            low = price
        else:
            high, picked = price, choice
    # what the hull leaves over
    room = error_budget - errors[picked, blocks].sum()
    while True:
        gain, worse = sizes[picked, blocks] - sizes, errors - errors[picked, blocks]
        worth = np.where((gain > 0) & (worse <= room), gain / np.maximum(worse, 1e-12), 0.0)
        row, block = np.unravel_index(np.argmax(worth), worth.shape)
        if worth[row, block] <= 0:
            return picked
        room -= worse[row, block]
        picked[block] = row
