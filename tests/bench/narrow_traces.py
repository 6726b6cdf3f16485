"""Recorded 3G lines, for `narrow.py`: stalls against those of the lowest rate alone, the rate against an oracle's."""

from __future__ import annotations

import asyncio
import csv
from pathlib import Path

import numpy as np

from bunraku.client.api import Client
from tests.bench.narrow_viewer import LINKS, BenchContext, Figures, MeasuringViewer
from tests.bench.network import EmulatedLink, narrowlink_path


async def measure_traces(bench: BenchContext, seconds: float, *means: str) -> Figures:
    """Case traces, at the mean rates of these of `LINES`."""
    figures: Figures = {}
    files = sorted(narrowlink_path().parent.glob("3Glogs_*.csv"))
    async with Client(bench.url) as client:
        motion = await client.motion(bench.motion)
    costs = [rate["kbps"] for rate in motion["rates"]]
    for name in means:
        rows = [_read_trace(file) for file in files]
        links = [
            EmulatedLink(delay_ms=75, trace=str(file), trace_scale=LINKS[name].bitrate / _mean_bps(row))
            for file, row in zip(files, rows, strict=True)
        ]
        with bench.network.open_links(links * 2) as fars:
            screens = [
                bench.create_motion_viewer(far, "?tracks=motion" if nth < len(links) else "?tracks=motion&rate=0")
                for nth, far in enumerate(fars)
            ]
            await asyncio.gather(*(screen.watch_and_measure(seconds, frame=1 / 15) for screen in screens))
        ours, lowest = screens[: len(links)], screens[len(links) :]
        watched = seconds * 1e3 * len(links)
        mine, theirs = (sum(_blank_ms(screen, seconds) for screen in group) for group in (ours, lowest))
        figures[f"traces_stalled_percent_{name}"] = round(100 * mine / watched, 3)
        figures[f"traces_stalled_lowest_percent_{name}"] = round(100 * theirs / watched, 3)
        best = [
            best_constant_kbps(row, link.trace_scale, costs, seconds) for row, link in zip(rows, links, strict=True)
        ]
        got = [screen.statistics.shown_kbps for screen in ours]
        figures[f"traces_shown_kbps_{name}"] = round(float(np.mean(got)), 2)
        figures[f"traces_best_kbps_{name}"] = round(float(np.mean(best)), 2)
        figures[f"traces_share_of_best_{name}"] = round(float(np.mean(got) / np.mean(best)), 3)
    return figures


def best_constant_kbps(trace: list[tuple[float, float]], scale: float, costs: list[float], seconds: float) -> float:
    """The best constant rate, kbit/s, that one who knows the trace could send: a block a second from the beginning on
    as fast as the line goes, as far ahead as he likes, in time but for what the lowest rate is late too. Heads are
    counted as if each block were a packet of its own."""
    ends = np.cumsum([ms / 1e3 for ms, _ in trace])
    grid = np.arange(0.0, seconds, 0.01)
    rates = np.array([kbps for _, kbps in trace])[
        np.searchsorted(ends, grid % ends[-1], side="right").clip(0, len(trace) - 1)
    ]
    carried = np.cumsum(np.maximum(rates * 1e3 * scale, 1.0)) * 0.01

    def late(cost: float) -> float:
        """Seconds that blocks come after they are due, the first block's wait included for all."""
        bits = (np.arange(int(seconds)) + 1) * (cost * 1e3 + 60 * 8) + 8_000
        came = np.searchsorted(carried, bits) * 0.01 + 0.5
        shift, stalls = came[0], 0.0
        for nth, at in enumerate(came):
            wait = max(at - (shift + nth), 0.0)
            stalls += wait
            shift += wait
        return stalls

    least = late(costs[0])
    return max(cost for cost in costs if late(cost) <= least + 0.001 * seconds)


def _read_trace(file: Path) -> list[tuple[float, float]]:
    with file.open() as opened:
        return [(float(ms), float(kbps)) for ms, kbps, *_ in list(csv.reader(opened))[1:]]


def _mean_bps(trace: list[tuple[float, float]]) -> float:
    """Mean rate of a trace, bit/s."""
    return sum(ms * kbps for ms, kbps in trace) / sum(ms for ms, _ in trace) * 1e3


def _blank_ms(screen: MeasuringViewer, seconds: float) -> float:
    """Milliseconds without a picture, from the beginning on."""
    if not screen.shown:
        return seconds * 1e3
    return (screen.shown[0][0] - screen.started_us) / 1e3 + screen.statistics.dark_ms
