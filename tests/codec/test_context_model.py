from __future__ import annotations

import numpy as np

from bunraku.codec import context_model, prior
from bunraku.codec.context_model import MAX_SCALE, MIN_SCALE

PRIOR = prior.load_shipped_prior()


def predicted_scales(magnitude: int) -> list[int]:
    """The scales of the third channel's frequencies where everything before has one size."""
    seen = context_model.create_context_model(12)
    found = []
    for channel in range(3):
        for k in range(12):
            context_model.compute_shared_sums(PRIOR, seen, channel, k, 12, 120, 64)
            for axis in range(3):
                found.append(context_model.predict_scale(PRIOR, seen, channel, axis, k))
                context_model.update_magnitude(seen, channel, axis, k, magnitude)
            context_model.finish_frequency(seen, channel, k)
        context_model.finish_channel(seen, channel, 12)
    return found[2 * 36 :]


def test_large_neighbours_make_large_sizes_expected() -> None:
    nothing, some, much = (np.array(predicted_scales(size)) for size in (0, 4, 200))
    # of high frequencies at least: the lowest say little of each other
    assert (nothing[12:] < some[12:]).all()
    assert (some[12:] < much[12:]).all()


def test_scales_stay_within_their_bounds() -> None:
    for size in (0, 4095, 1 << 19):
        assert MIN_SCALE <= min(predicted_scales(size)) <= max(predicted_scales(size)) <= MAX_SCALE


def test_the_hidden_layer_of_a_prior_is_heard() -> None:
    loud = PRIOR._replace(
        hidden_class=np.full_like(PRIOR.hidden_class, 1 << 20),
        out=np.full_like(PRIOR.out, 4096),
        hidden=0 * PRIOR.hidden,
    )
    seen = context_model.create_context_model(3)
    context_model.compute_shared_sums(loud, seen, 0, 0, 3, 120, 64)
    assert context_model.predict_scale(loud, seen, 0, 0, 0) == MAX_SCALE


def test_signs_look_two_and_four_frequencies_back() -> None:
    q = np.zeros((19, 3, 9), dtype=np.int64)
    assert context_model.sign_context(q, 4, 1, 6) == 7
    q[4, 1, 4], q[4, 1, 2] = -9, 3
    assert context_model.sign_context(q, 4, 1, 6) == 2
    # the mean of a movement says nothing of how it moves
    q[4, 1, 0] = 5
    assert context_model.sign_context(q, 4, 1, 2) == 7
