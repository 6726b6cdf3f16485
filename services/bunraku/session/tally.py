"""What the stages of one replica count as they go, in plain numbers that stay when a stage ends."""

from __future__ import annotations

from collections import Counter

from bunraku.backing.metrics import Distribution
from bunraku.marionette.ownership import Outcome

RATE = "rate"
"""Beside the outcomes, of inputs dropped at the door they came in by: there were too many."""
SOLVING = (0.0001, 0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25)
"""Bounds for a tick's work, seconds: two frames have 66 ms."""


class Tally:
    """Of one replica, since it began."""

    def __init__(self) -> None:
        self.inputs: dict[str, int] = {**{outcome.value: 0 for outcome in Outcome}, RATE: 0}
        """By what became of them."""
        self.hand_overs = 0
        """Limbs that went to who had asked for them."""
        self.sessions: Counter[tuple[str, ...]] = Counter({("opened",): 0, ("taken over",): 0, ("handed on",): 0})
        """By how they came to this replica, or left it for another."""
        self.solving = Distribution(SOLVING)
        """Of one tick of a stage, all its limbs and frames."""
        self.late = Distribution(SOLVING)
        """How much later than planned a tick began."""
