from __future__ import annotations

from pathlib import Path

import numpy as np

from bunraku.codec.prior import FEATURE_COUNT, load_shipped_prior
from tests.training.test_entropy_study import write_clip
from training import large_network, limit_study


def test_untrained_network_leaves_the_bits_of_every_model(tmp_path: Path) -> None:
    write_clip(tmp_path, "a", 30.0)
    blocks = limit_study.encode_evaluated(tmp_path, "a", 5.0)
    parameters = large_network.initial_parameters(FEATURE_COUNT, 8)
    figures = limit_study.measure(blocks, parameters)
    assert figures["network"] == figures["signs of the prior"] == figures["prior"]


def test_family_contributes_runs_of_successive_blocks(tmp_path: Path) -> None:
    write_clip(tmp_path, "a", 60.0)
    first, again = (limit_study.collect_family(tmp_path, "x", ["a"], 6, load_shipped_prior()) for _ in range(2))
    assert len(first) >= 6
    for one, other in zip(first, again, strict=True):
        for array, same in zip(one, other, strict=True):
            np.testing.assert_array_equal(array, same)


def test_variants_see_more_and_more() -> None:
    assert list(limit_study.INPUTS.values()) == sorted(limit_study.INPUTS.values())
    examples = limit_study.INPUTS["and the previous block"]
    assert large_network.initial_parameters(examples, 4)[0].shape == (examples + 64, 4)
