"""Metrics of the stream service."""

from __future__ import annotations

from bunraku.runtime.metrics import Metrics
from bunraku.stream.counters import StreamCounters
from bunraku.stream.watched_session import WatchedSessions


def register_metrics(metrics: Metrics, counters: StreamCounters, sessions: WatchedSessions) -> None:
    """Register gauges and counters of this replica's viewers and sessions."""
    metrics.gauge("viewers", "Connected viewers, by motions and sessions", counters.viewers_by_kind, ("of",))
    metrics.counter(
        "viewers_joined_total", "Viewers that connected, by motions and sessions", counters.joined.copy, ("of",)
    )
    metrics.gauge("watched_sessions", "Sessions with at least one viewer at this replica", lambda: len(sessions))
    metrics.counter("sent_bytes_total", "Bytes written to viewers, including frame headers", lambda: counters.bytes)
    metrics.counter("sent_blocks_total", "Blocks sent, counted once for each viewer", lambda: counters.blocks)
    metrics.counter("sent_overlays_total", "Overlays sent, counted once for each viewer", lambda: counters.overlays)
    metrics.counter(
        "skipped_overlays_total",
        "Overlays replaced by a newer one before the link had capacity",
        lambda: counters.skipped_overlays,
    )
    metrics.counter(
        "dropped_viewers_total", "Viewers disconnected by the server, by reason", counters.dropped.copy, ("reason",)
    )
    metrics.gauge(
        "viewer_rates",
        "Viewers by bitrate level of the motion and reason for it",
        counters.viewers_by_level,
        ("rate", "reason"),
    )
    metrics.gauge("slow_viewers", "Viewers whose connection is not writable", lambda: len(counters.unsent_bytes()))
    metrics.gauge("held_bytes", "Bytes buffered in the process for such viewers", lambda: sum(counters.unsent_bytes()))
