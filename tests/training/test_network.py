from __future__ import annotations

import numpy as np
import numpy.typing as npt

from bunraku.codec._kernels import bit_cost
from bunraku.codec.prior import FEATURE_COUNT, SHAPES, load_shipped_prior
from training import network


def random_examples(count: int) -> tuple[npt.NDArray[np.int16], npt.NDArray[np.int32]]:
    """Generate magnitudes that the features roughly predict, some beyond every table."""
    random = np.random.default_rng(4)
    features = random.integers(0, 140, (count, FEATURE_COUNT)).astype(np.int16)
    frequency_class, axis = random.integers(0, 7, count), random.integers(0, 57, count)
    magnitude = np.floor(2.0 ** (features[:, 24] / 16 + random.normal(0, 1.5, count)) * random.random(count))
    sign = np.where(magnitude > 0, random.integers(1, 3, count), 0)
    return features, np.stack([frequency_class, axis, magnitude, sign, random.integers(0, 15, count)], axis=1).astype(
        np.int32
    )


def loss_and_gradients(
    parameters: list[network.Array], features: object, labels: object
) -> tuple[float, list[network.Array]]:
    gradients = [np.zeros_like(p) for p in parameters]
    rows = np.arange(len(labels))  # type: ignore[arg-type]
    total = network._accumulate_loss(features, labels, rows, *parameters, *gradients)  # type: ignore[arg-type]
    return total, gradients


def test_gradients_equal_finite_differences() -> None:
    features, labels = random_examples(400)
    # magnitudes within the tables, where the loss is differentiable
    labels[:, 2] = np.minimum(labels[:, 2], 6)
    parameters = network.initial_parameters()
    parameters[0] *= 0.2
    _, gradients = loss_and_gradients(parameters, features, labels)
    random = np.random.default_rng(5)
    for which in (0, 1, 5, 6):
        direction = random.normal(size=parameters[which].shape)
        losses = []
        for delta in (1e-6, -1e-6):
            moved = [p.copy() for p in parameters]
            moved[which] += delta * direction
            losses.append(loss_and_gradients(moved, features, labels)[0])
        slope = (losses[0] - losses[1]) / 2e-6
        np.testing.assert_allclose((gradients[which] * direction).sum(), slope, rtol=0.02, atol=0.5)


def test_loss_equals_the_estimated_bits() -> None:
    """Otherwise training exploits the difference: for example, an escape that is not counted seems free."""
    features, labels = random_examples(3000)
    parameters = network.initial_parameters()
    prior = network.quantise_prior(parameters, labels)
    costs, bits = bit_cost.build_cost_table(prior), 0.0
    f = features.astype(np.int64)
    scales = ((f * prior.linear[labels[:, 0]]).sum(axis=1) + prior.bias[labels[:, 0], labels[:, 1]]) >> 8
    for j in range(len(prior.hidden)):
        x = (f * prior.hidden[j]).sum(axis=1) + prior.hidden_bias[j, labels[:, 1]] + prior.hidden_class[j, labels[:, 0]]
        scales += np.where(x > 0, (np.minimum(x >> 8, 32767) * prior.out[j, labels[:, 0]]) >> 12, 0)
    for frequency_class, scale, magnitude in zip(labels[:, 0], np.clip(scales, -1792, 3584), labels[:, 2], strict=True):
        bits += bit_cost.coefficient_bits(costs, frequency_class, int(scale), int(magnitude)) - (magnitude > 0)
    assert labels[:, 2].max() > 1000
    np.testing.assert_allclose(loss_and_gradients(parameters, features, labels)[0] / np.log(2), bits, rtol=0.03)


def test_training_lowers_the_loss() -> None:
    features, labels = random_examples(3000)
    before = network.initial_parameters()
    after = network.train(features, labels, before, 60, lambda _: None, batch_size=1024)
    assert loss_and_gradients(after, features, labels)[0] < 0.9 * loss_and_gradients(before, features, labels)[0]
    for name, array in network.quantise_prior(after, labels)._asdict().items():
        assert array.shape == getattr(SHAPES, name)
    assert load_shipped_prior().hazard.shape == SHAPES.hazard


def test_parameters_of_a_prior_are_those_it_was_quantised_from() -> None:
    shipped = load_shipped_prior()
    quantised = network.quantise_prior(network.to_parameters(shipped), np.zeros((0, 5), dtype=np.int32))
    for name in set(shipped._fields) - {"sign"}:
        np.testing.assert_array_equal(getattr(quantised, name), getattr(shipped, name), err_msg=name)


def test_more_hidden_units_count_as_many_bits_while_they_are_off() -> None:
    features, labels = random_examples(300)
    bits = []
    for hidden_units in (8, 24):
        parameters = network.initial_parameters(hidden_units=hidden_units)
        parameters[5][:] = 0
        bits.append(network.count_magnitude_bits(features, labels, parameters))
    assert bits[0] == bits[1] > 0
