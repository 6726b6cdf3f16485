from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec import coefficients
from bunraku.codec.channel_layout import SCENE_LAYOUT
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.prior import IntArray, load_shipped_prior
from bunraku.kernels import load_kernels
from bunraku.motion.rotation import Array

KERNELS, PRIOR = load_kernels("codec"), load_shipped_prior()
COSTS = KERNELS.build_cost_table(PRIOR)
AXES = np.arange(3) < SCENE_LAYOUT.axes[:, None]


def quantise(spectrum: Array, bit_price: float) -> IntArray:
    q = np.zeros(spectrum.shape, dtype=np.int64)
    context = KERNELS.create_context_model(PRIOR, SCENE_LAYOUT, spectrum.shape[2], 150, 64)
    KERNELS.quantise_values(context, COSTS, spectrum, bit_price, q)
    return q


def block_bytes(q: IntArray) -> int:
    header = BlockHeader(q.shape[2], 150, 0)
    return len(coefficients.encode_coefficients(PRIOR, header, q, q.shape[2], 30.0, SCENE_LAYOUT))


def random_spectrum(seed: int) -> Array:
    generator = np.random.default_rng(seed)
    spectrum: Array = generator.laplace(size=(3, 3, 16)) * 8.0 * np.exp(-0.4 * np.arange(16)) * AXES[..., None]
    return spectrum


@given(st.integers(0, 1000))
def test_free_bits_give_the_nearest_magnitudes(seed: int) -> None:
    spectrum = random_spectrum(seed)
    q = quantise(spectrum, 0.0)
    assert np.abs(np.abs(spectrum) - np.abs(q)).max() <= 0.56
    assert (q * spectrum >= 0).all()


@given(st.integers(0, 200))
def test_dear_bits_save_bytes_for_error(seed: int) -> None:
    spectrum = random_spectrum(seed)
    exact, cheap = quantise(spectrum, 0.0), quantise(spectrum, 0.3)
    assert block_bytes(cheap) <= block_bytes(exact)
    assert np.square(spectrum - cheap).sum() >= np.square(spectrum - exact).sum() - 0.1 * spectrum.size


def test_costs_of_offsets_are_least_near_the_scale_of_an_axis() -> None:
    offsets = np.arange(-8, 8)
    totals = np.zeros((3, 3, len(offsets)))
    for seed in range(40):
        q = np.round(random_spectrum(seed)).astype(np.int64)
        q[1] = 0
        context = KERNELS.create_context_model(PRIOR, SCENE_LAYOUT, 16, 150, 64)
        KERNELS.add_offset_costs(context, COSTS, q, 128 * offsets, totals)
    assert (totals[1].argmin(axis=1) <= 1).all(), "an axis that never moves has the lowest offset"
    assert (totals[0].argmin(axis=1) > 0).all()
    assert not totals[2, 1:].any(), "axes that are not coded cost nothing"
