from __future__ import annotations

import numpy as np
import pytest

from tests.training.test_large_network import make_examples
from training import large_network, mixing


def test_weights_that_do_not_adapt_are_those_of_the_network() -> None:
    examples = make_examples(400)
    corrections = np.random.default_rng(3).normal(0, 0.3, (400, large_network.OUTPUTS)).astype(np.float32)
    expected = large_network.count_bits(examples, corrections).magnitudes
    assert mixing.count_mixed_bits(examples, corrections, np.array([0, 150]), 0.0) == pytest.approx(expected, rel=1e-3)


def test_mixing_corrects_a_network_that_is_too_sure() -> None:
    examples = make_examples(2000)
    corrections = (3 * examples.decision_logits[:, : large_network.OUTPUTS]).astype(np.float32)
    before = large_network.count_bits(examples, corrections).magnitudes
    assert mixing.count_mixed_bits(examples, corrections, np.array([0]), 0.01) < 0.95 * before


def test_blocks_are_independent() -> None:
    examples = make_examples(600)
    corrections = np.zeros((600, large_network.OUTPUTS), np.float32)
    whole = mixing.count_mixed_bits(examples, corrections, np.array([0, 200]), 0.01)
    parts = [slice(0, 200), slice(200, 600)]
    separate = [
        mixing.count_mixed_bits(large_network.select(examples, part), corrections[part], np.array([0]), 0.01)
        for part in parts
    ]
    assert whole == pytest.approx(sum(separate))
