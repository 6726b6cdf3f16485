"""Bit allocation among blocks with a Lagrange multiplier (Shoham and Gersho 1988)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.motion.rotation import Array


def select_cheapest(sizes: Array, errors: Array, error_budget: float) -> npt.NDArray[np.int64]:
    """Select one encoding of each block, so that the errors sum up to at most the budget with few bytes.

    Args:
        sizes: Bytes (encodings, blocks).
        errors: Errors (encodings, blocks).
        error_budget: Limit of the sum of the selected errors.

    Returns:
        The selected encoding (blocks,). The total size is near the minimum.

    Raises:
        ValueError: Even the smallest errors exceed the budget.
    """
    blocks = np.arange(sizes.shape[1])
    smallest = errors.min(axis=0).sum()
    if smallest > error_budget:
        raise ValueError(
            f"Error budget of {error_budget:g} is out of reach: the errors sum up to at least {smallest:g}."
        )
    selected: npt.NDArray[np.int64] = np.argmin(errors, axis=0)
    low, high = 1e-9, 1e9
    for _ in range(80):
        price = float(np.sqrt(low * high))
        choice = np.argmin(sizes + price * errors, axis=0)
        if errors[choice, blocks].sum() > error_budget:
            low = price
        else:
            high, selected = price, choice
    # spend what remains of the budget on encodings that are not on the convex hull
    remaining = error_budget - errors[selected, blocks].sum()
    while True:
        saved_bytes, added_error = sizes[selected, blocks] - sizes, errors - errors[selected, blocks]
        gain = np.where(
            (saved_bytes > 0) & (added_error <= remaining), saved_bytes / np.maximum(added_error, 1e-12), 0.0
        )
        row, block = np.unravel_index(np.argmax(gain), gain.shape)
        if gain[row, block] <= 0:
            return selected
        remaining -= added_error[row, block]
        selected[block] = row
