"""What the ingest service tells of itself."""

from __future__ import annotations

from bunraku.ingest.motion import UploadOperation
from bunraku.runtime.metrics import Metrics


def register_metrics(metrics: Metrics, uploads: UploadOperation) -> None:
    """Have what is on its way in counted."""
    places, queue = uploads.worker_slots, uploads.job_queue
    metrics.gauge("uploads_under_way", "Uploads that are received or made a motion of", lambda: uploads.active_count)
    metrics.gauge("jobs_waiting", "Jobs that wait for a place to work at", lambda: places.waiting_jobs)
    metrics.gauge("jobs_running", "Jobs that are at work", lambda: places.running_jobs)
    metrics.counter("jobs_resumed_total", "Jobs taken up that another replica left", lambda: queue.resumed_jobs)
    metrics.histograms(
        "job_duration_seconds",
        "Jobs by kind and outcome, and how long they took",
        places.durations,
        ("kind", "outcome"),
    )
