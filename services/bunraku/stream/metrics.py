"""What the stream service tells of itself."""

from __future__ import annotations

from bunraku.runtime.metrics import Metrics
from bunraku.stream.counters import StreamCounters
from bunraku.stream.watched_session import WatchedSessions


def register_metrics(metrics: Metrics, counters: StreamCounters, sessions: WatchedSessions) -> None:
    """Have the viewers of this replica counted."""
    metrics.gauge("viewers", "Viewers here now, of motions and of sessions", counters.viewers_by_kind, ("of",))
    metrics.counter(
        "viewers_joined_total", "Viewers that came, of motions and of sessions", counters.joined.copy, ("of",)
    )
    metrics.gauge("watched_sessions", "Sessions that somebody watches here", lambda: len(sessions))
    metrics.counter("sent_bytes_total", "Bytes written to viewers, frames whole", lambda: counters.bytes)
    metrics.counter("sent_blocks_total", "Blocks sent, one for each viewer", lambda: counters.blocks)
    metrics.counter("sent_overlays_total", "Overlays sent, one for each viewer", lambda: counters.overlays)
    metrics.counter(
        "skipped_overlays_total",
        "Overlays that a newer one took the place of on a full line",
        lambda: counters.skipped_overlays,
    )
    metrics.counter("dropped_viewers_total", "Viewers ended from here, by why", counters.dropped.copy, ("reason",))
    metrics.gauge(
        "viewer_rates", "Viewers at each rate of the motion, and why", counters.viewers_by_level, ("rate", "reason")
    )
    metrics.gauge("slow_viewers", "Viewers whose line is full now", lambda: len(counters.unsent_bytes()))
    metrics.gauge("held_bytes", "Bytes that wait here for full lines", lambda: sum(counters.unsent_bytes()))
