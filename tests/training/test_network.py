from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.codec import bit_cost
from bunraku.codec.prior import FEATURE_COUNT, SHAPES, load_shipped_prior
from training import network


def random_examples(count: int) -> tuple[npt.NDArray[np.int16], npt.NDArray[np.int32]]:
    """Sizes that the features foretell, more or less, some beyond every table."""
    random = np.random.default_rng(4)
    features = random.integers(0, 140, (count, FEATURE_COUNT)).astype(np.int16)
    group, axis = random.integers(0, 7, count), random.integers(0, 57, count)
    size = np.floor(2.0 ** (features[:, 24] / 16 + random.normal(0, 1.5, count)) * random.random(count))
    sign = np.where(size > 0, random.integers(1, 3, count), 0)
    return features, np.stack([group, axis, size, sign, random.integers(0, 15, count)], axis=1).astype(np.int32)


def loss_and_gradients(
    parameters: list[network.Array], features: object, labels: object
) -> tuple[float, list[network.Array]]:
    gradients = [np.zeros_like(p) for p in parameters]
    total = network._accumulate_loss(features, labels, np.arange(len(labels)), *parameters, *gradients)  # type: ignore[arg-type]
    return total, gradients


def test_gradients_are_those_of_the_loss() -> None:
    features, where = random_examples(400)
    # within the table, where the loss has no corners
    where[:, 2] = np.minimum(where[:, 2], 6)
    parameters = network.initial_parameters()
    parameters[0] *= 0.2
    _, gradients = loss_and_gradients(parameters, features, where)
    random = np.random.default_rng(5)
    for which in (0, 1, 5, 6):
        direction = random.normal(size=parameters[which].shape)
        found = []
        for by in (1e-6, -1e-6):
            moved = [p.copy() for p in parameters]
            moved[which] += by * direction
            found.append(loss_and_gradients(moved, features, where)[0])
        slope = (found[0] - found[1]) / 2e-6
        np.testing.assert_allclose((gradients[which] * direction).sum(), slope, rtol=0.02, atol=0.5)


def test_the_loss_is_what_the_coder_costs() -> None:
    """Else the prior learns to please the loss: an escape that is not counted looks free."""
    features, where = random_examples(3000)
    parameters = network.initial_parameters()
    prior = network.quantise_prior(parameters, where)
    table, spent = bit_cost.build_cost_table(prior), 0.0
    f = features.astype(np.int64)
    scaled = ((f * prior.linear[where[:, 0]]).sum(axis=1) + prior.bias[where[:, 0], where[:, 1]]) >> 8
    for j in range(len(prior.hidden)):
        x = (f * prior.hidden[j]).sum(axis=1) + prior.hidden_bias[j, where[:, 1]] + prior.hidden_class[j, where[:, 0]]
        scaled += np.where(x > 0, (np.minimum(x >> 8, 32767) * prior.out[j, where[:, 0]]) >> 12, 0)
    for group, expected, size in zip(where[:, 0], np.clip(scaled, -1792, 3584), where[:, 2], strict=True):
        spent += bit_cost.coefficient_bits(table, group, int(expected), int(size)) - (size > 0)
    assert where[:, 2].max() > 1000
    np.testing.assert_allclose(loss_and_gradients(parameters, features, where)[0] / np.log(2), spent, rtol=0.03)


def test_training_lowers_the_loss_and_gives_a_prior() -> None:
    features, where = random_examples(3000)
    before = network.initial_parameters()
    after = network.train(features, where, before, 60, lambda _: None, batch_size=1024)
    assert loss_and_gradients(after, features, where)[0] < 0.9 * loss_and_gradients(before, features, where)[0]
    for name, array in network.quantise_prior(after, where)._asdict().items():
        assert array.shape == getattr(SHAPES, name)
    assert load_shipped_prior().hazard.shape == SHAPES.hazard
