"""Counters of the stages of one replica, which outlive the stages."""

from __future__ import annotations

from collections import Counter

from bunraku.marionette.ownership import InputOutcome
from bunraku.runtime.metrics import Histogram

RATE_LIMITED = "rate"
"""Label of inputs that the rate limit drops, beside the labels of `InputOutcome`."""
TICK_BUCKETS_S = (0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25)
"""Upper bounds of the histogram buckets; two frames take 66 ms."""


class SessionCounters:
    """Counters of one replica since its start."""

    def __init__(self) -> None:
        self.inputs: dict[str, int] = {**{outcome.value: 0 for outcome in InputOutcome}, RATE_LIMITED: 0}
        """Inputs by outcome."""
        self.hand_overs = 0
        """Limbs granted to puppeteers who had asked for them."""
        self.sessions: Counter[tuple[str, ...]] = Counter({("opened",): 0, ("taken over",): 0, ("handed on",): 0})
        """Sessions by how they came to this replica or left it."""
        self.tick_duration_s = Histogram(TICK_BUCKETS_S)
        """Duration of one tick of a stage with all its limbs and frames."""
        self.tick_lateness_s = Histogram(TICK_BUCKETS_S)
        """Delay of a tick against its planned time."""
