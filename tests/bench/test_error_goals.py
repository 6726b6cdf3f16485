from __future__ import annotations

import pytest

from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM
from bunraku.codec.prior import load_shipped_prior
from tests.bench.error_goals import GoalEncoding, encode_as_served, encode_to_goal, geometric_mean, summarise_tails
from tests.vectors.blocks import random_motion


@pytest.mark.parametrize("kind", ["mean", "max"])
def test_smaller_error_costs_more(kind: str) -> None:
    motion = random_motion(2.0, 30.0, 5)
    fine, coarse = (encode_to_goal(motion, (kind, error), load_shipped_prior(), 1.0) for error in (2.0, 20.0))
    assert len(fine.message_bytes) == len(coarse.message_bytes) == 2
    assert fine.kbps > coarse.kbps > sum(coarse.message_bytes) * 8e-3 / motion.duration


def test_served_ladder_adds_no_block_and_costs_little_more() -> None:
    motion, prior = random_motion(3.0, 30.0, 5), load_shipped_prior()
    served = encode_as_served(motion, prior)
    assert tuple(served) == ERROR_BOUNDS_MM
    for bound in ERROR_BOUNDS_MM[:2]:
        alone = encode_to_goal(motion, ("max", bound), prior, 1.0)
        assert len(served[bound].message_bytes) == len(alone.message_bytes)
        assert served[bound].kbps < 1.15 * alone.kbps


def test_tails_are_those_of_clips_and_of_blocks() -> None:
    encodings = [GoalEncoding(2.0, [10] * 96), GoalEncoding(5.0, [100] * 5)]
    assert summarise_tails(encodings) == {"kbps_worst_clip": 5.0, "block_bytes_p95": pytest.approx(10.0)}
    assert geometric_mean([2.0, 8.0]) == pytest.approx(4.0)
