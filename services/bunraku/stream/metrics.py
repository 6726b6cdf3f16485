"""What the stream service tells of itself."""

from __future__ import annotations

from bunraku.backing.metrics import Metrics
from bunraku.stream.attendance import Attendance
from bunraku.stream.sessions import WatchedSessions


def register(metrics: Metrics, attendance: Attendance, sessions: WatchedSessions) -> None:
    """Have the viewers of this replica counted."""
    metrics.gauge("viewers", "Viewers here now, of motions and of sessions", attendance.here, ("of",))
    metrics.counter(
        "viewers_joined_total", "Viewers that came, of motions and of sessions", attendance.came.copy, ("of",)
    )
    metrics.gauge("watched_sessions", "Sessions that somebody watches here", lambda: len(sessions))
    metrics.counter("sent_bytes_total", "Bytes written to viewers, frames whole", lambda: attendance.bytes)
    metrics.counter("sent_blocks_total", "Blocks sent, one for each viewer", lambda: attendance.blocks)
    metrics.counter("sent_overlays_total", "Overlays sent, one for each viewer", lambda: attendance.overlays)
    metrics.counter(
        "skipped_overlays_total",
        "Overlays that a newer one took the place of on a full line",
        lambda: attendance.skipped,
    )
    metrics.counter("dropped_viewers_total", "Viewers ended from here, by why", attendance.dropped.copy, ("reason",))
    metrics.gauge("viewer_rates", "Viewers at each rate of the motion, and why", attendance.choices, ("rate", "reason"))
    metrics.gauge("slow_viewers", "Viewers whose line is full now", lambda: len(attendance.waiting()))
    metrics.gauge("held_bytes", "Bytes that wait here for full lines", lambda: sum(attendance.waiting()))
