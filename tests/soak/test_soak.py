"""Short run of the soak test on real backends, and its trend of memory."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.processes import find_program
from tests.soak.audience import HISTOGRAM_MS, GapHistogram
from tests.soak.samples import MIN_TREND_S, WARM_UP_S, SampleLog


def test_short_run_loses_nothing_and_reports_figures() -> None:
    find_program("nats-server")
    command = ["--minutes", "0.25", "--viewers", "12", "--churn", "1", "--max-gap-ms", str(HISTOGRAM_MS)]
    command += ["--min-acknowledged", "2"]
    ran = subprocess.run([sys.executable, "-m", "tests.soak", *command], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    *minutes, last = ran.stdout.splitlines()
    figures = json.loads(last)
    assert len(minutes) == 1
    assert "12 viewers" in minutes[0]
    assert figures["held"]
    assert figures["kills"] >= 1
    assert figures["acknowledged"] >= 2
    assert figures["gap_p99_ms"] > 0


def test_slope_counts_only_the_time_after_the_warm_up() -> None:
    log = SampleLog()
    for second in range(0, int(WARM_UP_S + MIN_TREND_S) + 20, 10):
        warm = max(second - WARM_UP_S, 0.0)
        # 100 MB during the warm-up, then 3 MB in 10 minutes
        rss = 200.0 + min(second, WARM_UP_S) / 3 + warm / 200
        log.add(1_000.0 + second, {"stream 1": (7, rss, 30), "brief": (100 + second, 1.0, 1)})
    assert log.worst_slopes() == {"stream 1": pytest.approx(3.0, abs=0.05)}


def test_histogram_gives_percentiles_in_milliseconds() -> None:
    histogram = GapHistogram()
    assert histogram.percentile(0.99) == 0.0
    for _ in range(98):
        histogram.add(0.033)
    for gap in (0.5, 99.0):
        histogram.add(gap)
    assert histogram.percentile(0.5) == 33.0
    assert histogram.percentile(0.99) == 500.0
    assert histogram.percentile(1.0) == HISTOGRAM_MS - 1
