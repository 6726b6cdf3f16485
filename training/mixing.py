"""Logistic mixing of predictions (Mahoney 2005), for the study of the limit.

Three experts predict every decision about a magnitude: the shipped prior, a large network, and counters that adapt
within the block. Their log odds are summed with weights that adapt too. Everything starts afresh in each block, because
blocks are independent.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from bunraku.codec.prior import CHANNEL_AXES, FREQUENCY_CLASSES, UNARY_DECISIONS
from training.large_network import CORRECTIONS, Examples, Float32

_WEIGHT_SETS = 4
"""Sets of weights: one for each of the first decisions, the last for all others."""
_COUNTER_RATE = 0.06


def count_mixed_bits(
    examples: Examples,
    corrections: Float32,
    block_starts: npt.NDArray[np.int64],
    weight_rate: float,
) -> float:
    """Return the bits of the magnitudes of whole blocks if three experts are mixed.

    `block_starts` (B) are the first examples of the blocks; the weights adapt by `weight_rate`.
    """
    decided = _mixed_nats(
        examples.decision_logits.astype(np.float32),
        corrections,
        examples.high,
        examples.labels,
        np.append(block_starts, len(examples.labels)),
        weight_rate,
    )
    return decided / float(np.log(2)) + float(examples.fixed_bits.sum(dtype=np.float64))


@njit(cache=True)
def _mixed_nats(
    logits: Float32,
    corrections: Float32,
    high: npt.NDArray[np.int32],
    labels: npt.NDArray[np.int32],
    limits: npt.NDArray[np.int64],
    weight_rate: float,
) -> float:
    total, experts = 0.0, np.zeros(3)
    for block in range(len(limits) - 1):
        weights = np.zeros((FREQUENCY_CLASSES, _WEIGHT_SETS, 3))
        weights[:, :, 1] = 1.0
        # difference of a channel axis from what the network predicts, as log odds
        counters = np.zeros((CHANNEL_AXES, _WEIGHT_SETS))
        for i in range(limits[block], limits[block + 1]):
            for value in range(UNARY_DECISIONS):
                if high[i] < value:
                    break
                known = min(value, _WEIGHT_SETS - 1)
                experts[0] = logits[i, value]
                experts[1] = logits[i, value] + corrections[i, min(value, CORRECTIONS - 1)]
                experts[2] = experts[1] + counters[labels[i, 1], known]
                w = weights[labels[i, 0], known]
                z = w[0] * experts[0] + w[1] * experts[1] + w[2] * experts[2]
                one = 1.0 if high[i] > value else 0.0
                total += np.log1p(np.exp(-z)) if one > 0 else np.log1p(np.exp(z))
                miss = one - 1 / (1 + np.exp(-z))
                for expert in range(3):
                    w[expert] += weight_rate * miss * experts[expert]
                counters[labels[i, 1], known] += _COUNTER_RATE * (one - 1 / (1 + np.exp(-experts[2])))
    return total
