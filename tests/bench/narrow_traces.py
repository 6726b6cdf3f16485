"""Recorded 3G links, for `narrow.py`: stalls against the lowest bitrate level, mean bitrate against an oracle."""

from __future__ import annotations

import asyncio
import csv
from pathlib import Path

import numpy as np

from bunraku.client.api import Client
from tests.bench.narrow_viewer import LINKS, BenchContext, Figures, MeasuringViewer
from tests.bench.network import EmulatedLink, narrowlink_path


async def measure_traces(bench: BenchContext, seconds: float, *link_names: str) -> Figures:
    """Measure the case `traces` at the mean bitrates of these entries of `LINKS`."""
    figures: Figures = {}
    files = sorted(narrowlink_path().parent.glob("3Glogs_*.csv"))
    async with Client(bench.url) as client:
        motion = await client.motion(bench.motion)
    costs = [rate["kbps"] for rate in motion["rates"]]
    for name in link_names:
        rows = [_read_trace(file) for file in files]
        links = [
            EmulatedLink(delay_ms=75, trace=str(file), trace_scale=LINKS[name].bitrate / _mean_bps(row))
            for file, row in zip(files, rows, strict=True)
        ]
        with bench.network.open_links(links * 2) as fars:
            viewers = [
                bench.create_motion_viewer(far, "?tracks=motion" if nth < len(links) else "?tracks=motion&rate=0")
                for nth, far in enumerate(fars)
            ]
            await asyncio.gather(*(viewer.watch_and_measure(seconds, frame_interval=1 / 15) for viewer in viewers))
        adaptive, lowest = viewers[: len(links)], viewers[len(links) :]
        watched = seconds * 1e3 * len(links)
        adaptive_ms, lowest_ms = (sum(_blank_ms(viewer, seconds) for viewer in group) for group in (adaptive, lowest))
        figures[f"traces_stalled_percent_{name}"] = round(100 * adaptive_ms / watched, 3)
        figures[f"traces_stalled_lowest_percent_{name}"] = round(100 * lowest_ms / watched, 3)
        best = [
            best_constant_kbps(row, link.trace_scale, costs, seconds) for row, link in zip(rows, links, strict=True)
        ]
        shown = [viewer.statistics.shown_kbps for viewer in adaptive]
        figures[f"traces_shown_kbps_{name}"] = round(float(np.mean(shown)), 2)
        figures[f"traces_best_kbps_{name}"] = round(float(np.mean(best)), 2)
        figures[f"traces_share_of_best_{name}"] = round(float(np.mean(shown) / np.mean(best)), 3)
    return figures


def best_constant_kbps(trace: list[tuple[float, float]], scale: float, costs: list[float], seconds: float) -> float:
    """Return the best constant bitrate that a sender with knowledge of the trace could use, kbit/s.

    The sender sends a block per second from the beginning, as fast as the link allows and as far ahead as it likes.
    Blocks may be late only where the lowest bitrate level is late too. Headers count as for one packet per block.
    """
    ends = np.cumsum([ms / 1e3 for ms, _ in trace])
    grid = np.arange(0.0, seconds, 0.01)
    rates = np.array([kbps for _, kbps in trace])[
        np.searchsorted(ends, grid % ends[-1], side="right").clip(0, len(trace) - 1)
    ]
    transferred = np.cumsum(np.maximum(rates * 1e3 * scale, 1.0)) * 0.01

    def lateness_s(cost: float) -> float:
        """Return the seconds that blocks are late, including the wait for the first block."""
        bits = (np.arange(int(seconds)) + 1) * (cost * 1e3 + 60 * 8) + 8_000
        arrivals = np.searchsorted(transferred, bits) * 0.01 + 0.5
        shift, stalls = arrivals[0], 0.0
        for nth, at in enumerate(arrivals):
            wait = max(at - (shift + nth), 0.0)
            stalls += wait
            shift += wait
        return stalls

    least = lateness_s(costs[0])
    return max(cost for cost in costs if lateness_s(cost) <= least + 0.001 * seconds)


def _read_trace(file: Path) -> list[tuple[float, float]]:
    with file.open() as opened:
        return [(float(ms), float(kbps)) for ms, kbps, *_ in list(csv.reader(opened))[1:]]


def _mean_bps(trace: list[tuple[float, float]]) -> float:
    """Return the mean bitrate of a trace, bit/s."""
    return sum(ms * kbps for ms, kbps in trace) / sum(ms for ms, _ in trace) * 1e3


def _blank_ms(viewer: MeasuringViewer, seconds: float) -> float:
    """Return the time without a picture, from the beginning, milliseconds."""
    if not viewer.shown:
        return seconds * 1e3
    return (viewer.shown[0][0] - viewer.started_us) / 1e3 + viewer.statistics.dark_ms
