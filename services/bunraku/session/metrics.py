"""Metrics of the session service."""

from __future__ import annotations

from bunraku.runtime.metrics import Metrics
from bunraku.session.session_manager import SessionManager


def register_metrics(metrics: Metrics, sessions: SessionManager) -> None:
    """Register the metrics of the stages of this replica."""
    counters = sessions.counters

    def count_held_limbs() -> int:
        return sum(holder is not None for stage in sessions.stages for holder in stage.holders)

    metrics.gauge("sessions", "Sessions that this replica owns", lambda: len(sessions.stages))
    metrics.gauge("puppeteers", "Puppeteers on its stages", lambda: sum(len(s.puppeteers) for s in sessions.stages))
    metrics.gauge("limbs_held", "Limbs in somebody's hands", count_held_limbs)
    metrics.counter("sessions_moved_total", "Sessions by how they came or went", counters.sessions.copy, ("how",))
    metrics.counter("hand_overs_total", "Limbs that went to who had asked for them", lambda: counters.hand_overs)
    metrics.counter(
        "inputs_total",
        "Inputs by outcome: taken, reach (taken, brought within reach), owner, late, rate (dropped at the door)",
        lambda: {(outcome,): number for outcome, number in counters.inputs.copy().items()},
        ("outcome",),
    )
    metrics.histogram(
        "solve_duration_seconds", "What one tick of a stage takes: limbs of all frames", counters.tick_duration_s
    )
    metrics.histogram("stage_late_seconds", "How much later than planned a tick began", counters.tick_lateness_s)
