"""Large network of the study of the limit: a perceptron that corrects every decision of the shipped prior.

It is not meant to be shipped. Two hidden layers see all contexts; the outputs are added to the log odds with which the
prior codes the decisions "magnitude greater than v?" and the sign. So an untrained network costs as many bits as the
prior alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.codec.prior import (
    CHANNEL_AXES,
    FREQUENCY_CLASSES,
    HAZARD_ROWS,
    HAZARD_TABLE_OF,
    UNARY_DECISIONS,
    Prior,
)
from bunraku.motion.rotation import Array

Float32 = npt.NDArray[np.float32]

CORRECTIONS = 8
"""Decisions with a correction of their own; all later ones share the last."""
OUTPUTS = CORRECTIONS + 1
_ONE_HOT_COUNT = CHANNEL_AXES + FREQUENCY_CLASSES
_LN2 = float(np.log(2))
_LEARNING_RATE = 1.5e-3
_WEIGHT_DECAY = 0.01


class Examples(NamedTuple):
    """Coefficients with what is known before each.

    `inputs` (N, I) are features and contexts; `labels` (N, 5) have the columns `entropy_coder.LABEL_...`. The prior
    codes the decisions about `high` (N), the magnitude without its lowest bits, with log odds `decision_logits`
    (N, 18), and the sign, negative being one, with `sign_logits` (N). `fixed_bits` (N) are coded without a model.
    """

    inputs: npt.NDArray[np.float16]
    labels: npt.NDArray[np.int32]
    high: npt.NDArray[np.int32]
    decision_logits: npt.NDArray[np.float16]
    sign_logits: npt.NDArray[np.float16]
    fixed_bits: npt.NDArray[np.float16]


class Bits(NamedTuple):
    """Bits of magnitudes and signs of some examples."""

    magnitudes: float
    signs: float


def prepare_examples(
    prior: Prior,
    features: npt.NDArray[np.int16],
    labels: npt.NDArray[np.int32],
    contexts: npt.NDArray[np.float16],
) -> Examples:
    """Return the examples of coefficients, with the predictions of a prior (proto/codec.md, 2.9 to 2.11)."""
    f, frequency_class, axis = features.astype(np.float32), labels[:, 0], labels[:, 1]
    scale = (np.einsum("nf,nf->n", f, prior.linear.astype(np.float32)[frequency_class])) / 256
    scale += prior.bias[frequency_class, axis] / 256
    inner = f @ prior.hidden.T.astype(np.float32) + prior.hidden_bias.T[axis] + prior.hidden_class.T[frequency_class]
    scale += (np.maximum(inner, 0) / 256 * prior.out.T[frequency_class]).sum(axis=1) / 4096
    scale = np.clip(scale, -1792, 3584)
    shift = np.where(scale >= 1024, scale // 256 - 3, 0).astype(np.int32)
    position = (scale - 256 * shift + 1792) / 64
    row = np.minimum(position.astype(np.int32), HAZARD_ROWS - 2)
    weight = np.minimum(position - row, 1.0)[:, None]
    row += HAZARD_ROWS * HAZARD_TABLE_OF[frequency_class].astype(np.int32)
    p = (prior.hazard[row] * (1 - weight) + prior.hazard[row + 1] * weight) / 32768
    high = labels[:, 2] >> shift
    escaped = np.where(high >= UNARY_DECISIONS, 2 * np.floor(np.log2(np.maximum(high - 17, 1))) + 1, 0)
    p_negative = prior.sign[frequency_class, labels[:, 4]] / 32768
    inputs = np.concatenate([(f / 16).astype(np.float16), contexts], axis=1)
    return Examples(inputs, labels, high, _log_odds(p), _log_odds(p_negative), (shift + escaped).astype(np.float16))


def initial_parameters(inputs: int, hidden_units: int, seed: int = 0) -> list[Float32]:
    """Return the parameters of an untrained network: two hidden layers, and outputs of zero from both."""
    random = np.random.default_rng(seed)
    width = inputs + _ONE_HOT_COUNT
    return [
        random.normal(0, np.sqrt(1.0 / width), (width, hidden_units)).astype(np.float32),
        np.zeros(hidden_units, np.float32),
        random.normal(0, np.sqrt(2.0 / hidden_units), (hidden_units, hidden_units)).astype(np.float32),
        np.zeros(hidden_units, np.float32),
        np.zeros((2 * hidden_units, OUTPUTS), np.float32),
        np.zeros(OUTPUTS, np.float32),
    ]


def correct(examples: Examples, parameters: list[Float32]) -> Float32:
    """Return the corrections (N, OUTPUTS) of the log odds."""
    return _forward(_network_inputs(examples, parameters), parameters)[-1]


def count_bits(examples: Examples, corrections: Float32) -> Bits:
    """Return the bits of the examples with corrections (N, OUTPUTS)."""
    magnitudes, signs, _ = _loss(examples, corrections)
    return Bits(magnitudes / _LN2 + float(examples.fixed_bits.sum(dtype=np.float64)), signs / _LN2)


def loss_and_gradients(examples: Examples, parameters: list[Float32]) -> tuple[float, list[Float32]]:
    """Return the cost of some examples in nats, and its gradients."""
    x = _network_inputs(examples, parameters)
    first, second, corrections = _forward(x, parameters)
    magnitudes, signs, d_out = _loss(examples, corrections)
    hidden = parameters[1].size
    joined = np.concatenate([first, second], axis=1)
    d_joined = d_out @ parameters[4].T
    d_second = d_joined[:, hidden:] * (second > 0)
    d_first = (d_joined[:, :hidden] + d_second @ parameters[2].T) * (first > 0)
    gradients = [x.T @ d_first, d_first.sum(0), first.T @ d_second, d_second.sum(0), joined.T @ d_out, d_out.sum(0)]
    return magnitudes + signs, gradients


def train(
    examples: Examples,
    parameters: list[Float32],
    steps: int,
    report: Callable[[str], None],
    batch_size: int = 4096,
) -> list[Float32]:
    """Return parameters after `steps` of Adam with decoupled weight decay and cosine decay of the learning rate."""
    random, parameters = np.random.default_rng(0), [p.copy() for p in parameters]
    first, second = [np.zeros_like(p) for p in parameters], [np.zeros_like(p) for p in parameters]
    total = 0.0
    for step in range(1, steps + 1):
        rows = random.integers(0, len(examples.labels), batch_size)
        loss, gradients = loss_and_gradients(select(examples, rows), parameters)
        total += loss / batch_size / _LN2
        rate = _LEARNING_RATE * min(1.0, step / 50) * 0.5 * (1 + np.cos(np.pi * step / steps))
        for p, g, m, v in zip(parameters, gradients, first, second, strict=True):
            m += 0.1 * (g / batch_size - m)
            v += 0.002 * ((g / batch_size) ** 2 - v)
            p -= rate * (m / (1 - 0.9**step) / (np.sqrt(v / (1 - 0.998**step)) + 1e-8) + _WEIGHT_DECAY * p)
        if step % 200 == 0:
            report(f"  step {step}: {total / 200:.4f} bits per coefficient that a model decides")
            total = 0.0
    return parameters


def select(examples: Examples, rows: npt.NDArray[np.int64] | slice) -> Examples:
    """Return some of the examples."""
    return Examples._make(array[rows] for array in examples)


def join(parts: list[Examples]) -> Examples:
    """Return all examples of several parts."""
    return Examples._make(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def _log_odds(p: Array) -> npt.NDArray[np.float16]:
    return np.log(p / (1 - p)).astype(np.float16)


def _network_inputs(examples: Examples, parameters: list[Float32]) -> Float32:
    """Return the inputs of the first layer: features, contexts, and one-hot vectors of channel axis and class."""
    count, used = len(examples.labels), len(parameters[0]) - _ONE_HOT_COUNT
    x = np.zeros((count, used + _ONE_HOT_COUNT), np.float32)
    x[:, :used] = examples.inputs[:, :used]
    rows = np.arange(count)
    x[rows, used + examples.labels[:, 1]] = 1
    x[rows, used + CHANNEL_AXES + examples.labels[:, 0]] = 1
    return x


def _forward(x: Float32, parameters: list[Float32]) -> tuple[Float32, Float32, Float32]:
    first = np.maximum(x @ parameters[0] + parameters[1], 0)
    second = np.maximum(first @ parameters[2] + parameters[3], 0)
    return first, second, np.concatenate([first, second], axis=1) @ parameters[4] + parameters[5]


def _loss(examples: Examples, corrections: Float32) -> tuple[float, float, Float32]:
    """Return the cost of magnitudes and of signs in nats, and the gradient (N, OUTPUTS) by the corrections."""
    d_out, magnitudes = np.zeros_like(corrections), 0.0
    for value in range(UNARY_DECISIONS):
        rows = np.flatnonzero(examples.high >= value)
        if not len(rows):
            break
        column = min(value, CORRECTIONS - 1)
        z = examples.decision_logits[rows, value].astype(np.float32) + corrections[rows, column]
        target = examples.high[rows] > value
        magnitudes += float((np.logaddexp(0, z) - target * z).sum(dtype=np.float64))
        d_out[rows, column] += 1 / (1 + np.exp(-z)) - target
    rows = np.flatnonzero(examples.labels[:, 3])
    z = examples.sign_logits[rows].astype(np.float32) + corrections[rows, CORRECTIONS]
    target = examples.labels[rows, 3] == 2
    signs = float((np.logaddexp(0, z) - target * z).sum(dtype=np.float64))
    d_out[rows, CORRECTIONS] = 1 / (1 + np.exp(-z)) - target
    return magnitudes, signs, d_out
