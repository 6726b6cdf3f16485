from __future__ import annotations

import pytest

from tests.bench import peer_results

# kbit/s, mean, max, frames kept
ROWS = [
    [10.0, 1.0, 4.0, 1.0],
    [2.0, 8.0, 20.0, 1.0],
    [9.0, 3.0, 9.0, 1.0],
    [30.0, 0.5, 2.0, 1.0],
    [12.0, 2.0, 30.0, 1.0],
]


def test_lower_hull_drops_dominated_points() -> None:
    assert peer_results.lower_hull(ROWS, peer_results.MEAN) == [(0.5, 30.0), (1.0, 10.0), (8.0, 2.0)]


def test_peer_bitrate_is_interpolated_log_log() -> None:
    assert peer_results.interpolate_kbps(ROWS, peer_results.MEAN, 1.0) == pytest.approx(10.0)
    assert peer_results.interpolate_kbps(ROWS, peer_results.MEAN, 8**0.5) == pytest.approx(20**0.5)
    with pytest.raises(ValueError, match="measured from"):
        peer_results.interpolate_kbps(ROWS, peer_results.MEAN, 0.4)


def test_mean_curve_covers_errors_measured_for_every_clip() -> None:
    slower = [[row[0] * 4, *row[1:]] for row in ROWS if row[1] < 4]
    points = peer_results.mean_curve([ROWS, slower], peer_results.MEAN, 0.1, 100.0)
    assert (points[0][0], points[-1][0]) == (0.5, 3.0)
    assert points[0][1] == pytest.approx(60.0)
    assert [error for error, _ in points] == sorted(error for error, _ in points)
    assert peer_results.mean_curve([ROWS], peer_results.MEAN, 1.0, 2.0)[0] == pytest.approx((1.0, 10.0))
