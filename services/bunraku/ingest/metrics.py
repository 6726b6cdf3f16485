"""Metrics of the ingest service."""

from __future__ import annotations

from bunraku.ingest.job_queue import JobQueue
from bunraku.ingest.upload import UploadReceiver
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.metrics import Metrics


def register_metrics(metrics: Metrics, uploads: UploadReceiver, queue: JobQueue, slots: WorkerSlots) -> None:
    """Register the metrics of uploads and jobs."""
    metrics.gauge("uploads_under_way", "Uploads being received or processed", lambda: uploads.active_count)
    metrics.gauge("jobs_waiting", "Jobs waiting for a worker slot", lambda: slots.waiting_jobs)
    metrics.gauge("jobs_running", "Jobs running", lambda: slots.running_jobs)
    metrics.counter("jobs_resumed_total", "Jobs of failed replicas resumed here", lambda: queue.resumed_jobs)
    metrics.histograms(
        "job_duration_seconds", "Duration of jobs by kind and outcome", slots.durations, ("kind", "outcome")
    )
