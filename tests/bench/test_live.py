from __future__ import annotations

import numpy as np
import pytest

from bunraku.motion.rotation import Array
from tests.bench.live import compare_motions
from tests.bench.live_sender import bounce
from tests.bench.live_stage import CAPTURE_FPS, Source, match_poses


def moving_source() -> Source:
    """Return a source whose points move to one side at 1 m/s."""
    source = Source.__new__(Source)
    source.points = np.zeros((120, 23, 3))
    source.points[..., 0] = np.arange(120)[:, None] / CAPTURE_FPS
    return source


def test_clip_runs_forth_and_back_without_a_jump() -> None:
    assert [bounce(number, 4) for number in range(8)] == [0, 1, 2, 3, 2, 1, 0, 1]
    frames = np.array([0.5, 118.5, 119.5, 237.5])
    places = moving_source().points_at(frames)[:, 0, 0] * CAPTURE_FPS
    assert places == pytest.approx([0.5, 118.5, 118.5, 0.5])


def test_lag_and_error_of_shown_poses_are_found() -> None:
    source = moving_source()
    begin_us = 1_000_000
    times = begin_us + np.array([1e6, 1.2e6, 1.4e6, 1.6e6, 2.2e6])
    frames: Array = (times - 80_000 - begin_us) * 1e-6 * CAPTURE_FPS
    points = source.points_at(frames)
    match = match_poses(source, begin_us, times, points + np.array([0.0, 0.003, 0.0]))
    # before the last pose the clip has turned, so that it is that of two times
    assert match.lags_ms == pytest.approx(np.full(4, 80.0), abs=2.0)
    assert match.errors_mm == pytest.approx(np.full(5, 3.0), abs=0.2)


def test_archive_is_compared_where_it_begins() -> None:
    take = np.cumsum(np.random.default_rng(1).normal(0.0, 0.01, (200, 23, 3)), axis=0)
    archived = 0.5 * (take[40:150] + take[41:151])
    assert compare_motions(take, archived + np.array([0.001, 0.0, 0.0])) == pytest.approx(1.0, abs=0.05)
