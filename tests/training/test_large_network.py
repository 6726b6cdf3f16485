from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.prior import FEATURE_COUNT, load_shipped_prior
from tests.training.test_network import random_examples
from training import block_contexts, large_network, network


def make_examples(count: int) -> large_network.Examples:
    features, labels = random_examples(count)
    contexts = np.random.default_rng(2).normal(size=(count, block_contexts.CONTEXT_COUNT)).astype(np.float16)
    return large_network.prepare_examples(load_shipped_prior(), features, labels, contexts)


def test_untrained_network_costs_as_many_bits_as_the_prior() -> None:
    prior, (features, labels) = load_shipped_prior(), random_examples(1500)
    examples = make_examples(1500)
    parameters = large_network.initial_parameters(FEATURE_COUNT + block_contexts.CONTEXT_COUNT, 16)
    bits = large_network.count_bits(examples, large_network.correct(examples, parameters))
    expected = network.count_magnitude_bits(features, labels, network.to_parameters(prior))
    assert bits.magnitudes == pytest.approx(expected, rel=2e-3)
    # a sign is predicted by no more than two frequencies
    assert bits.signs == pytest.approx((labels[:, 3] > 0).sum(), rel=0.1)


def test_gradients_equal_finite_differences() -> None:
    examples, random = make_examples(300), np.random.default_rng(1)
    parameters = large_network.initial_parameters(FEATURE_COUNT, 12)
    parameters[4][:] = random.normal(0, 0.1, parameters[4].shape)
    _, gradients = large_network.loss_and_gradients(examples, parameters)
    for which, gradient in enumerate(gradients):
        direction, losses = random.normal(size=gradient.shape).astype(np.float32), []
        for delta in (3e-3, -3e-3):
            moved = [p.copy() for p in parameters]
            moved[which] += np.float32(delta) * direction
            losses.append(large_network.loss_and_gradients(examples, moved)[0])
        np.testing.assert_allclose((gradient * direction).sum(), (losses[0] - losses[1]) / 6e-3, rtol=0.03, atol=0.3)


def test_training_lowers_the_bits() -> None:
    examples = make_examples(2000)
    before = large_network.initial_parameters(FEATURE_COUNT, 16)
    after = large_network.train(examples, before, 60, lambda _: None, batch_size=512)
    totals = [sum(large_network.count_bits(examples, large_network.correct(examples, p))) for p in (before, after)]
    assert totals[1] < 0.95 * totals[0]


def test_joined_examples_are_selected_again() -> None:
    examples = make_examples(50)
    parts = [large_network.select(examples, slice(0, 20)), large_network.select(examples, slice(20, 50))]
    for array, again in zip(examples, large_network.join(parts), strict=True):
        np.testing.assert_array_equal(array, again)
