"""Network behind the prior: its parameters, loss and gradients, and the training.

Scales are in octaves, which the prior stores in 1/4096. Linear weights and a small hidden layer predict a scale; the
probabilities of "magnitude greater than v?" are interpolated between two rows of a hazard table (proto/codec.md, 2.11).
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from numba import njit

from bunraku.codec.prior import (
    CHANNEL_AXES,
    FEATURE_COUNT,
    FREQUENCY_CLASSES,
    HAZARD_ROWS,
    HAZARD_TABLE_OF,
    HIDDEN_UNITS,
    SIGN_CONTEXTS,
    UNARY_DECISIONS,
    Prior,
)

Array = npt.NDArray[np.float64]
_LN2 = float(np.log(2))
_LEARNING_RATE_FACTORS = (0.3, 1.0, 0.5, 0.5, 0.5, 0.3, 1.0)
_WEIGHT_DECAY = (5e-5, 5e-4, 5e-5, 5e-4, 0.0, 0.0, 0.0)
# biases decay to their mean, the others to zero
_DECAYS_TO_MEAN = (False, True, False, True, False, False, False)


def initial_parameters(seed: int = 0, hidden_units: int = HIDDEN_UNITS) -> list[Array]:
    """Return untrained parameters: linear, bias, hidden, hidden bias, hidden class, out, hazards (logits)."""
    random = np.random.default_rng(seed)
    linear, bias = np.zeros((FREQUENCY_CLASSES, FEATURE_COUNT)), np.full((FREQUENCY_CLASSES, CHANNEL_AXES), -0.8)
    linear[:, [24, 0, 3, 13, 27]] = 0.25, 0.25, 0.1, 0.2, 0.1
    linear[0, 22], bias[0] = -1.0, 9.0
    width = 2.0 ** (-7 + np.arange(HAZARD_ROWS) / 4)
    p = np.repeat(np.exp(-1 / (width + 0.15))[:, None], UNARY_DECISIONS, axis=1)
    return [
        linear,
        bias,
        random.normal(0, 0.15, (hidden_units, FEATURE_COUNT)),
        np.zeros((hidden_units, CHANNEL_AXES)),
        random.normal(0, 0.1, (hidden_units, FREQUENCY_CLASSES)),
        random.normal(0, 0.02, (hidden_units, FREQUENCY_CLASSES)),
        np.tile(np.log(p / (1 - p)), (HAZARD_TABLE_OF[-1] + 1, 1)),
    ]


@njit(cache=True, fastmath=True)
def _accumulate_loss(
    features: npt.NDArray[np.int16],
    labels: npt.NDArray[np.int32],
    rows: npt.NDArray[np.int64],
    linear: Array,
    bias: Array,
    hidden: Array,
    hidden_bias: Array,
    hidden_class: Array,
    out: Array,
    hazard: Array,
    d_linear: Array,
    d_bias: Array,
    d_hidden: Array,
    d_hidden_bias: Array,
    d_hidden_class: Array,
    d_out: Array,
    d_hazard: Array,
) -> float:
    """Return the cost of the magnitudes of some examples in nats, and add its gradients to `d_...`.

    Args:
        features: Features (N, 32) of all examples.
        labels: Labels (N, 5) of all examples, columns as `entropy_coder.LABEL_...`.
        rows: Examples of the batch.
        linear, ..., hazard: The parameters.
        d_linear, ..., d_hazard: Their gradients.
    """
    probabilities = 1 / (1 + np.exp(-hazard))
    d_probabilities = np.zeros_like(probabilities)
    inner, f, loss = np.zeros(len(hidden)), np.zeros(FEATURE_COUNT), 0.0
    for example in range(len(rows)):
        row = rows[example]
        frequency_class, axis, magnitude = labels[row, 0], labels[row, 1], labels[row, 2]
        scale = bias[frequency_class, axis]
        for i in range(FEATURE_COUNT):
            f[i] = features[row, i] * 0.0625
            scale += linear[frequency_class, i] * f[i]
        for j in range(len(hidden)):
            x = hidden_bias[j, axis] + hidden_class[j, frequency_class]
            for i in range(FEATURE_COUNT):
                x += hidden[j, i] * f[i]
            inner[j] = x
            if x > 0:
                scale += out[j, frequency_class] * x
        below, above = scale < -6.99, scale > 13.99
        scale = min(max(scale, -6.99), 13.99)
        shift = int(np.floor(scale)) - 3 if scale >= 4 else 0
        position = (scale - shift + 7) * 4
        hazard_row = min(int(position), HAZARD_ROWS - 2)
        weight = min(position - hazard_row, 1.0)
        hazard_row += HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class]
        high, slope = magnitude >> shift, 0.0
        loss += shift * _LN2
        for value in range(UNARY_DECISIONS):
            low_row, high_row = probabilities[hazard_row, value], probabilities[hazard_row + 1, value]
            p = low_row * (1 - weight) + high_row * weight
            if high > value:
                loss -= np.log(p)
                d_p = -1 / p
            else:
                loss -= np.log(1 - p)
                d_p = 1 / (1 - p)
            d_probabilities[hazard_row, value] += d_p * (1 - weight)
            d_probabilities[hazard_row + 1, value] += d_p * weight
            slope += d_p * (high_row - low_row)
            if high <= value:
                break
        slope *= 4
        if high >= UNARY_DECISIONS:
            # the length of an escape decreases by two bits per octave of the scale
            loss += (2 * np.floor(np.log2(high - UNARY_DECISIONS + 1)) + 1) * _LN2
            slope -= 2 * _LN2
        # at a limit of the scale, follow the gradient only back inside
        if not (below and slope > 0) and not (above and slope < 0):
            d_bias[frequency_class, axis] += slope
            for i in range(FEATURE_COUNT):
                d_linear[frequency_class, i] += slope * f[i]
            for j in range(len(hidden)):
                if inner[j] > 0:
                    d_out[j, frequency_class] += slope * inner[j]
                    x = slope * out[j, frequency_class]
                    d_hidden_bias[j, axis] += x
                    d_hidden_class[j, frequency_class] += x
                    for i in range(FEATURE_COUNT):
                        d_hidden[j, i] += x * f[i]
    d_hazard += d_probabilities * probabilities * (1 - probabilities)
    return loss


def train(
    features: npt.NDArray[np.int16],
    labels: npt.NDArray[np.int32],
    parameters: list[Array],
    steps: int,
    report: Callable[[str], None],
    seed: int = 0,
    batch_size: int = 1 << 16,
) -> list[Array]:
    """Return parameters after `steps` of Adam on random batches, with warm-up and cosine decay of the learning rate.

    `report` receives the progress every 300 steps.
    """
    random, parameters = np.random.default_rng(seed), [p.copy() for p in parameters]
    first, second = [np.zeros_like(p) for p in parameters], [np.zeros_like(p) for p in parameters]
    total_bits, started = 0.0, time.monotonic()
    for step in range(1, steps + 1):
        gradients = [np.zeros_like(p) for p in parameters]
        rows = random.integers(0, len(labels), batch_size)
        total_bits += _accumulate_loss(features, labels, rows, *parameters, *gradients) / batch_size / _LN2
        learning_rate = 0.03 * min(1.0, step / 30) * 0.5 * (1 + np.cos(np.pi * step / steps)) + 1e-4
        for i, p in enumerate(parameters):
            m, v, factor = first[i], second[i], _LEARNING_RATE_FACTORS[i]
            g = gradients[i] / batch_size + _WEIGHT_DECAY[i] * (
                p - p.mean(axis=1, keepdims=True) if _DECAYS_TO_MEAN[i] else p
            )
            m += 0.1 * (g - m)
            v += 0.01 * (g * g - v)
            p -= learning_rate * factor * (m / (1 - 0.9**step)) / (np.sqrt(v / (1 - 0.99**step)) + 1e-9)
        if step % 300 == 0:
            report(f"  step {step}: {total_bits / 300:.4f} bits per coefficient, {time.monotonic() - started:.0f} s")
            total_bits = 0.0
    return parameters


def count_magnitude_bits(
    features: npt.NDArray[np.int16], labels: npt.NDArray[np.int32], parameters: list[Array]
) -> float:
    """Return the bits that the magnitudes of all examples cost, without signs."""
    gradients = [np.zeros_like(p) for p in parameters]
    return _accumulate_loss(features, labels, np.arange(len(labels)), *parameters, *gradients) / _LN2


def to_parameters(prior: Prior) -> list[Array]:
    """Return the parameters of a prior, the inverse of `quantise_prior`. They contain no signs."""
    p = prior.hazard / 32768
    arrays = prior.linear / 4096, prior.bias / 65536, prior.hidden / 4096, prior.hidden_bias / 65536
    return [*arrays, prior.hidden_class / 65536, prior.out / 4096, np.log(p / (1 - p))]


def quantise_prior(parameters: list[Array], labels: npt.NDArray[np.int32]) -> Prior:
    """Return the prior of some parameters. Sign probabilities are counted in the examples."""
    linear, bias, hidden, hidden_bias, hidden_class, out, hazard = parameters
    counts = np.full((FREQUENCY_CLASSES, SIGN_CONTEXTS, 2), 20.0)
    signed = labels[labels[:, 3] > 0]
    np.add.at(counts, (signed[:, 0], signed[:, 4], signed[:, 3] - 1), 1)

    def to_integers(array: Array, scale: float, limit: int) -> npt.NDArray[np.int64]:
        return np.clip(np.round(array * scale), -limit, limit).astype(np.int64)

    def to_probabilities(p: Array) -> npt.NDArray[np.int64]:
        return np.clip(np.round(p * 32768), 24, 32768 - 24).astype(np.int64)

    return Prior(
        to_integers(linear, 4096, 32767),
        to_integers(bias, 4096 * 16, 1 << 22),
        to_integers(hidden, 4096, 32767),
        to_integers(hidden_bias, 4096 * 16, 1 << 22),
        to_integers(hidden_class, 4096 * 16, 1 << 22),
        to_integers(out, 4096, 32767),
        to_probabilities(1 / (1 + np.exp(-hazard))),
        to_probabilities(counts[:, :, 1] / counts.sum(axis=2)),
    )
