"""One limb that is open to a crowd, at the owner of the session: newest summary per replica, and the merged target."""

from __future__ import annotations

from functools import reduce

from bunraku.marionette.crowd.policy import VOTE_US, CrowdPolicy, gesture_points, mean_target, to_target
from bunraku.marionette.crowd.summary import UNITS, CrowdSummary
from bunraku.marionette.solver.vector import Vector

SUMMARY_LIFETIME_US = 400_000
"""Silence of a replica after which its pulls no longer count."""
MAX_REPLICAS = 64
"""Replicas whose summaries are kept."""


class CrowdLimb:
    """Crowd of one limb. Its cost depends on the number of replicas, not on that of members. Times are in µs."""

    def __init__(self, limb: int, policy: CrowdPolicy) -> None:
        self.policy = policy
        self._limb = limb
        self._gestures = gesture_points(limb)
        # replica -> time of the summary on the replica's clock, arrival, summary
        self._summaries: dict[str, tuple[int, int, CrowdSummary]] = {}
        self._vote: tuple[int, int] | None = None

    def receive(self, replica: str, sent_us: int, summary: CrowdSummary, now: int) -> bool:
        """Keep a replica's summary; return False if it is late, doubled, or of too many replicas."""
        before = self._summaries.get(replica)
        if before is None and len(self._summaries) >= MAX_REPLICAS:
            return False
        if before is not None and sent_us <= before[0]:
            return False
        self._summaries[replica] = sent_us, now, summary
        return True

    def merge(self, now: int) -> CrowdSummary:
        """Return the sum of the newest summaries; forget silent replicas."""
        for replica in [name for name, (_, at, _) in self._summaries.items() if now - at > SUMMARY_LIFETIME_US]:
            del self._summaries[replica]
        return reduce(CrowdSummary.merge, (summary for _, _, summary in self._summaries.values()), CrowdSummary())

    def target(self, merged: CrowdSummary, now: int) -> Vector | None:
        """Return the target of a merged summary; None if nobody pulls."""
        if merged.count == 0:
            self._vote = None
            return None
        if self.policy is CrowdPolicy.TURNS:
            assert merged.turn is not None
            x, y, z = merged.turn.point
        elif self.policy is CrowdPolicy.VOTE:
            x, y, z = self._gestures[self._count_votes(merged, now)].tolist()
        else:
            return to_target(self._limb, mean_target(merged, self.policy))
        return to_target(self._limb, (x / UNITS, y / UNITS, z / UNITS))

    def votes(self, merged: CrowdSummary) -> list[int] | None:
        """Return the votes for each gesture; None under another policy than `vote`."""
        return merged.votes[: len(self._gestures)].tolist() if self.policy is CrowdPolicy.VOTE else None

    def turn(self, merged: CrowdSummary) -> tuple[int, int] | None:
        """Return number and rank of the turn under the policy `turns`; None if nobody pulls."""
        if self.policy is not CrowdPolicy.TURNS or merged.turn is None:
            return None
        return -merged.turn.negative_turn, merged.turn.rank

    def _count_votes(self, merged: CrowdSummary, now: int) -> int:
        """Return the gesture of this interval: the one with the most votes at its begin, the first of equal ones."""
        interval = now // VOTE_US
        if self._vote is None or self._vote[0] != interval:
            self._vote = interval, int(merged.votes[: len(self._gestures)].argmax())
        return self._vote[1]
