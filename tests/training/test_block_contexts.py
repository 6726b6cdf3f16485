from __future__ import annotations

import numpy as np

from bunraku.codec.prior import IntArray
from training import block_contexts


def random_block(seed: int, frequencies: int, step: int = 100) -> block_contexts.CodedBlock:
    random = np.random.default_rng(seed)
    q: IntArray = random.integers(-6, 7, (19, 3, frequencies))
    return block_contexts.CodedBlock(q, step)


def test_contexts_depend_only_on_what_is_decoded_before() -> None:
    block, previous = random_block(1, 9), random_block(2, 12)
    contexts = block_contexts.collect_contexts(block, previous)
    assert contexts.shape == (19 * 9 * 3, block_contexts.CONTEXT_COUNT)
    order = [(channel, axis, k) for channel in range(19) for k in range(9) for axis in range(3)]
    for index in (0, 4, 100, 301, 510):
        changed = block_contexts.CodedBlock(block.q.copy(), block.step)
        changed.q[order[index]] += 5
        different = np.flatnonzero((block_contexts.collect_contexts(changed, previous) != contexts).any(axis=1))
        assert (different > index).all()
        assert len(different) > 0 or index > 500


def test_block_without_a_previous_one_has_no_contexts_from_it() -> None:
    contexts = block_contexts.collect_contexts(random_block(1, 9), None)
    assert not contexts[:, 2 * block_contexts.NEIGHBOUR_COUNT :].any()
    assert contexts[:, : 2 * block_contexts.NEIGHBOUR_COUNT].any(axis=0).all()


def test_distance_to_the_end_of_the_previous_block_is_that_of_the_cosines() -> None:
    """A block that begins where the previous one ends has no distance left after its last frequency."""
    previous = block_contexts.CodedBlock(np.zeros((19, 3, 3), dtype=np.int64), 116)
    previous.q[5, 1] = [10, 2, 1]
    end = 2.0 * (10 - 2 * np.sqrt(2.0) + np.sqrt(2.0))
    block = block_contexts.CodedBlock(np.zeros((19, 3, 2), dtype=np.int64), 100)
    block.q[5, 1, 0] = 7
    contexts = block_contexts.collect_contexts(block, previous).reshape(19, 2, 3, block_contexts.CONTEXT_COUNT)
    distance = contexts[5, :, 1, 2 * block_contexts.NEIGHBOUR_COUNT + 3].astype(float)
    np.testing.assert_allclose(distance, np.log2(1 + np.array([end, end - 7])), rtol=2e-3)
