from __future__ import annotations

import pytest

from tests.bench import peers

# kbit/s, mean, max, frames kept
ROWS = [
    [10.0, 1.0, 4.0, 1.0],
    [2.0, 8.0, 20.0, 1.0],
    [9.0, 3.0, 9.0, 1.0],
    [30.0, 0.5, 2.0, 1.0],
    [12.0, 2.0, 30.0, 1.0],
]


def test_only_the_lower_hull_counts() -> None:
    assert peers.hull(ROWS, peers.MEAN) == [(0.5, 30.0), (1.0, 10.0), (8.0, 2.0)]


def test_a_peer_is_read_log_log_between_its_points() -> None:
    assert peers.kbps(ROWS, peers.MEAN, 1.0) == pytest.approx(10.0)
    assert peers.kbps(ROWS, peers.MEAN, 8**0.5) == pytest.approx(20**0.5)
    with pytest.raises(ValueError, match="measured from"):
        peers.kbps(ROWS, peers.MEAN, 0.4)
