from __future__ import annotations

import pytest

from bunraku.marionette.crowd.crowd_limb import MAX_REPLICAS, SUMMARY_LIFETIME_US, CrowdLimb
from bunraku.marionette.crowd.policy import HAND_GESTURES, TURN_US, VOTE_US, CrowdPolicy
from bunraku.marionette.crowd.pulls import CrowdPulls
from bunraku.marionette.crowd.summary import CrowdSummary
from bunraku.marionette.solver.vector import Vector


def summary_of(*targets: Vector, now: int = 0, first_key: int = 1) -> CrowdSummary:
    pulls = CrowdPulls(0)
    for n, target in enumerate(targets):
        pulls.pull(first_key + n, target, now)
    return pulls.summarise(now)


def test_late_and_doubled_summaries_have_no_effect() -> None:
    limb = CrowdLimb(0, CrowdPolicy.MEDIAN)
    assert limb.receive("a", 10, summary_of((0.5, 0.0, 0.0)), 0)
    assert not limb.receive("a", 10, summary_of((0.9, 0.0, 0.0)), 1)
    assert not limb.receive("a", 9, summary_of((0.9, 0.0, 0.0)), 1)
    assert limb.receive("b", 1, summary_of((0.5, 0.0, 0.0), first_key=9), 1)
    assert limb.merge(2).count == 2
    assert limb.target(limb.merge(2), 2) == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)


def test_silent_replica_is_forgotten_and_replicas_are_bounded() -> None:
    limb = CrowdLimb(0, CrowdPolicy.TRIMMED_MEAN)
    for n in range(MAX_REPLICAS):
        assert limb.receive(str(n), 1, summary_of((0.5, 0.0, 0.0)), n)
    assert not limb.receive("more", 1, summary_of((0.5, 0.0, 0.0)), 99)
    assert limb.merge(SUMMARY_LIFETIME_US + 1).count == MAX_REPLICAS - 1
    merged = limb.merge(2 * SUMMARY_LIFETIME_US)
    assert merged.count == 0
    assert limb.target(merged, 2 * SUMMARY_LIFETIME_US) is None


def test_turn_is_that_of_one_member() -> None:
    limb = CrowdLimb(0, CrowdPolicy.TURNS)
    targets = [(0.1, 0.0, 0.0), (0.5, 0.0, 0.0), (0.9, 0.0, 0.0)]
    for n, target in enumerate(targets):
        limb.receive(str(n), 1, summary_of(target, now=TURN_US, first_key=n), TURN_US)
    chosen = limb.target(limb.merge(TURN_US), TURN_US)
    assert chosen is not None
    assert min(abs(chosen[0] - x) for x, _, _ in targets) < 1e-3


def test_vote_holds_for_its_interval() -> None:
    limb = CrowdLimb(0, CrowdPolicy.VOTE)
    up, down = HAND_GESTURES["up"], HAND_GESTURES["down"]
    limb.receive("a", 1, summary_of(up, up, down), 0)
    assert limb.target(limb.merge(0), 0) == pytest.approx(up, abs=1e-3)
    limb.receive("a", 2, summary_of(up, down, down), VOTE_US - 1)
    assert limb.target(limb.merge(VOTE_US - 1), VOTE_US - 1) == pytest.approx(up, abs=1e-3)
    assert limb.target(limb.merge(VOTE_US), VOTE_US) == pytest.approx(down, abs=1e-3)
