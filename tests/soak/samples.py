"""Samples of memory and descriptors over the life of each process, and their trend."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

WARM_UP_S = 1_020.0
"""Time after the start of a process whose samples do not count.

With a kill every 5 minutes, the other replica of a service is killed 15 minutes after this one has started, and its
clients come over: the memory for twice the clients is part of the warm-up.
"""
MIN_TREND_S = 600.0
"""Shortest time of samples from which a trend is computed."""


@dataclass
class ProcessLife:
    """Samples of one process from its start to its end: seconds, MB and descriptors."""

    name: str
    started_at: float
    times: list[float] = field(default_factory=list)
    rss_mb: list[float] = field(default_factory=list)
    descriptors: list[int] = field(default_factory=list)

    def slope_mb(self) -> float | None:
        """Return the growth of memory after the warm-up, MB per 10 minutes; None if the process ran too briefly."""
        times, memory = np.array(self.times), np.array(self.rss_mb)
        warm = times >= self.started_at + WARM_UP_S
        if not warm.any() or times[warm][-1] - times[warm][0] < MIN_TREND_S:
            return None
        return round(float(np.polyfit(times[warm], memory[warm], 1)[0]) * 600.0, 3)


class SampleLog:
    """Lives of all processes by process id."""

    def __init__(self) -> None:
        self.lives: dict[int, ProcessLife] = {}

    def add(self, now: float, measured: dict[str, tuple[int, float, int]]) -> None:
        """Add the process id, memory and descriptors of each process, by name."""
        for name, (pid, rss_mb, descriptors) in measured.items():
            life = self.lives.setdefault(pid, ProcessLife(name, now))
            life.times.append(now)
            life.rss_mb.append(rss_mb)
            life.descriptors.append(descriptors)

    def worst_slopes(self) -> dict[str, float]:
        """Return the largest slope of each process by name, without those that ran too briefly."""
        worst: dict[str, float] = {}
        for life in self.lives.values():
            slope = life.slope_mb()
            if slope is not None:
                worst[life.name] = max(slope, worst.get(life.name, slope))
        return worst
