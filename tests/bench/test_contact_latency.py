from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.marionette.solver.vector import Vector
from tests.bench.contact_latency import pull_latencies_ms, run_pulls, summarise

FRAME_US = 16_667


def frames_of(positions: list[Vector], begin_us: int = 0) -> list[tuple[int, int, Vector]]:
    return [(begin_us + nth * FRAME_US, begin_us + nth * FRAME_US, place) for nth, place in enumerate(positions)]


def test_latency_ends_with_the_first_overlay_that_shows_the_pull() -> None:
    still, moved = (0.0, 0.0, 0.5), (0.0, 0.02, 0.5)
    frames = frames_of([still] * 10 + [moved] * 20)
    assert pull_latencies_ms(frames, [8 * FRAME_US + 1_000]) == pytest.approx([2 * FRAME_US / 1e3 - 1.0])


def test_pull_that_no_overlay_shows_in_time_is_left_out() -> None:
    still, moved = (0.0, 0.0, 0.5), (0.0, 0.02, 0.5)
    assert pull_latencies_ms(frames_of([still] * 100), [500_000]) == []
    assert pull_latencies_ms(frames_of([still] * 60 + [moved]), [100_000]) == []
    assert pull_latencies_ms([], [100_000]) == []


def test_summary_has_both_percentiles_and_their_ratio() -> None:
    figures = summarise([10.0] * 99 + [20.0], [11.0] * 100)
    assert (figures["single_p95_ms"], figures["bonded_p95_ms"], figures["bonded_p95_ratio"]) == (10.0, 11.0, 1.1)
    assert figures["pulls_seen"] == [100, 100]


async def test_pulls_of_a_bonded_pair_are_seen_by_another_viewer(server: str, tmp_path: Path) -> None:
    assert (await run_pulls(server, tmp_path, 3))["pulls_seen"] == [3, 3]
