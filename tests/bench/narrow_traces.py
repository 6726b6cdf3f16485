"""Recorded 3G lines, for `narrow.py`: stalls against those of the lowest rate alone, the rate against an oracle's."""

from __future__ import annotations

import asyncio
import csv
from pathlib import Path

import numpy as np

from bunraku.client.api import Client
from tests.bench.narrow_viewing import LINES, Bench, Figures, Screen
from tests.bench.network import Link, narrowlink_path


async def traces(bench: Bench, seconds: float, *means: str) -> Figures:
    """Case traces, at the mean rates of these of `LINES`."""
    figures: Figures = {}
    files = sorted(narrowlink_path().parent.glob("3Glogs_*.csv"))
    async with Client(bench.url) as client:
        motion = await client.motion(bench.motion)
    costs = [rate["kbps"] for rate in motion["rates"]]
    for name in means:
        rows = [_trace(file) for file in files]
        links = [
            Link(delay_ms=75, trace=str(file), scale=LINES[name].rate / _mean(row))
            for file, row in zip(files, rows, strict=True)
        ]
        with bench.net.lines(links * 2) as fars:
            screens = [
                bench.dance(far, "?tracks=motion" if nth < len(links) else "?tracks=motion&rate=0")
                for nth, far in enumerate(fars)
            ]
            await asyncio.gather(*(screen.look(seconds, frame=1 / 15) for screen in screens))
        ours, lowest = screens[: len(links)], screens[len(links) :]
        watched = seconds * 1e3 * len(links)
        mine, theirs = (sum(_dark(screen, seconds) for screen in group) for group in (ours, lowest))
        figures[f"traces_stalled_percent_{name}"] = round(100 * mine / watched, 3)
        figures[f"traces_stalled_lowest_percent_{name}"] = round(100 * theirs / watched, 3)
        best = [oracle(row, link.scale, costs, seconds) for row, link in zip(rows, links, strict=True)]
        got = [screen.figures.shown_kbps for screen in ours]
        figures[f"traces_shown_kbps_{name}"] = round(float(np.mean(got)), 2)
        figures[f"traces_best_kbps_{name}"] = round(float(np.mean(best)), 2)
        figures[f"traces_share_of_best_{name}"] = round(float(np.mean(got) / np.mean(best)), 3)
    return figures


def oracle(row: list[tuple[float, float]], scale: float, costs: list[float], seconds: float) -> float:
    """The best constant rate, kbit/s, that one who knows the trace could send: a block a second from the beginning on
    as fast as the line goes, as far ahead as he likes, in time but for what the lowest rate is late too. Heads are
    counted as if each block were a packet of its own."""
    ends = np.cumsum([ms / 1e3 for ms, _ in row])
    grid = np.arange(0.0, seconds, 0.01)
    rates = np.array([kbps for _, kbps in row])[
        np.searchsorted(ends, grid % ends[-1], side="right").clip(0, len(row) - 1)
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


def _trace(file: Path) -> list[tuple[float, float]]:
    with file.open() as opened:
        return [(float(ms), float(kbps)) for ms, kbps, *_ in list(csv.reader(opened))[1:]]


def _mean(row: list[tuple[float, float]]) -> float:
    """Mean rate of a trace, bit/s."""
    return sum(ms * kbps for ms, kbps in row) / sum(ms for ms, _ in row) * 1e3


def _dark(screen: Screen, seconds: float) -> float:
    """Milliseconds without a picture, from the beginning on."""
    if not screen.shown:
        return seconds * 1e3
    return (screen.shown[0][0] - screen.begun) / 1e3 + screen.figures.dark_ms
