"""What the stages of one replica count as they go, in plain numbers that stay when a stage ends."""

from __future__ import annotations

from collections import Counter

from bunraku.marionette.ownership import InputOutcome
from bunraku.runtime.metrics import Histogram

RATE_LIMITED = "rate"
"""Beside the outcomes, of inputs dropped at the door they came in by: there were too many."""
TICK_BUCKETS_S = (0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25)
"""Bounds for a tick's work, seconds: two frames have 66 ms."""


class SessionCounters:
    """Of one replica, since it began."""

    def __init__(self) -> None:
        self.inputs: dict[str, int] = {**{outcome.value: 0 for outcome in InputOutcome}, RATE_LIMITED: 0}
        """By what became of them."""
        self.hand_overs = 0
        """Limbs that went to who had asked for them."""
        self.sessions: Counter[tuple[str, ...]] = Counter({("opened",): 0, ("taken over",): 0, ("handed on",): 0})
        """By how they came to this replica, or left it for another."""
        self.tick_duration_s = Histogram(TICK_BUCKETS_S)
        """Of one tick of a stage, all its limbs and frames."""
        self.tick_lateness_s = Histogram(TICK_BUCKETS_S)
        """How much later than planned a tick began."""
