from __future__ import annotations

import numpy as np

from bunraku.codec import prior
from bunraku.codec._kernels import context_model
from bunraku.codec._kernels.context_model import MAX_SCALE, MIN_SCALE
from bunraku.codec.channel_layout import MOTION_LAYOUT

PRIOR = prior.load_shipped_prior()


def predicted_scales(magnitude: int) -> list[int]:
    """Return the scales of the third channel's frequencies after coefficients of one magnitude."""
    context = context_model.create_context_model(PRIOR, MOTION_LAYOUT, 12, 120, 64)
    scales = []
    for channel in range(3):
        for k in range(12):
            context_model.compute_shared_sums(context, channel, k)
            for axis in range(3):
                scales.append(context_model.predict_scale(context, channel, axis, k))
                context_model.update_magnitude(context, channel, axis, k, magnitude)
            context_model.finish_frequency(context, channel, k)
        context_model.finish_channel(context, channel)
    return scales[2 * 36 :]


def test_larger_neighbours_raise_the_predicted_scale() -> None:
    zero, small, large = (np.array(predicted_scales(magnitude)) for magnitude in (0, 4, 200))
    # only of high frequencies: the lowest hardly depend on each other
    assert (zero[12:] < small[12:]).all()
    assert (small[12:] < large[12:]).all()


def test_scales_are_within_their_limits() -> None:
    for magnitude in (0, 4095, 1 << 19):
        scales = predicted_scales(magnitude)
        assert MIN_SCALE <= min(scales) <= max(scales) <= MAX_SCALE


def test_hidden_layer_contributes_to_the_scale() -> None:
    saturated = PRIOR._replace(
        hidden_class=np.full_like(PRIOR.hidden_class, 1 << 20),
        out=np.full_like(PRIOR.out, 4096),
        hidden=0 * PRIOR.hidden,
    )
    context = context_model.create_context_model(saturated, MOTION_LAYOUT, 3, 120, 64)
    context_model.compute_shared_sums(context, 0, 0)
    assert context_model.predict_scale(context, 0, 0, 0) == MAX_SCALE


def test_sign_context_depends_on_two_and_four_frequencies_below() -> None:
    q = np.zeros((19, 3, 9), dtype=np.int64)
    assert context_model.sign_context(q, 4, 1, 6) == 7
    q[4, 1, 4], q[4, 1, 2] = -9, 3
    assert context_model.sign_context(q, 4, 1, 6) == 2
    # the mean of a block does not predict its movement
    q[4, 1, 0] = 5
    assert context_model.sign_context(q, 4, 1, 2) == 7
