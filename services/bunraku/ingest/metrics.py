"""What the ingest service tells of itself."""

from __future__ import annotations

from bunraku.backing.metrics import Metrics
from bunraku.ingest.uploads import Uploads


def register(metrics: Metrics, uploads: Uploads) -> None:
    """Have what is on its way in counted."""
    places, queue = uploads.places, uploads.queue
    metrics.gauge("uploads_under_way", "Uploads that are received or made a motion of", lambda: uploads.under_way)
    metrics.gauge("jobs_waiting", "Jobs that wait for a place to work at", lambda: places.waiting)
    metrics.gauge("jobs_running", "Jobs that are at work", lambda: places.at_work)
    metrics.counter("jobs_resumed_total", "Jobs taken up that another replica left", lambda: queue.resumed)
    metrics.distributions(
        "job_duration_seconds", "Jobs by kind and outcome, and how long they took", places.times, ("kind", "outcome")
    )
