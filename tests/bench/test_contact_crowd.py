from __future__ import annotations

from tests.bench.contact_crowd import measure_cost, measure_sabotage


def test_saboteurs_move_the_limb_by_at_most_their_share() -> None:
    share, is_replayed = measure_sabotage("trimmed mean")
    assert 0.0 < share <= 0.1
    assert is_replayed


def test_cost_is_measured_with_both_crowds() -> None:
    figures = measure_cost((8, 80), seconds=2)
    assert figures["crowd_cost_ratio"] > 0.0
    assert figures["crowd_cost_us"] > 0
