from __future__ import annotations

from collections import Counter

from bunraku.marionette.crowd.policy import TURN_US
from bunraku.marionette.crowd.pulls import PULL_LIFETIME_US, CrowdPulls
from bunraku.marionette.crowd.summary import MAX_MEMBERS, SAMPLE_SIZE


def test_pull_ends_with_silence_or_with_its_member() -> None:
    pulls = CrowdPulls(1)
    pulls.pull(1, (0.5, 0.0, 0.0), 0)
    pulls.pull(2, (0.5, 0.0, 0.0), 100_000)
    assert pulls.summarise(PULL_LIFETIME_US).count == 2
    assert pulls.summarise(PULL_LIFETIME_US + 1).count == 1
    pulls.leave(2)
    assert pulls.summarise(PULL_LIFETIME_US + 1).count == len(pulls) == 0


def test_member_has_one_vote_whatever_it_sends() -> None:
    pulls = CrowdPulls(1)
    for n in range(50):
        pulls.pull(1, (0.9, 0.0, n / 1e3), n)
    pulls.pull(2, (-0.9, 0.0, 0.0), 50)
    summary = pulls.summarise(60)
    assert summary.count == 2
    assert summary.sums[0].sum() == 0


def test_target_beyond_reach_is_moved_to_the_reach() -> None:
    pulls = CrowdPulls(0)
    pulls.pull(1, (1e30, 0.0, 0.0), 0)
    assert pulls.summarise(0).sample[0].point == (8_192, 0, 0)


def test_members_are_bounded() -> None:
    pulls = CrowdPulls(2)
    for n in range(MAX_MEMBERS + 10):
        pulls.pull(n, (0.1, 0.0, 0.0), 0)
    assert len(pulls) == MAX_MEMBERS
    assert len(pulls.summarise(0).sample) == SAMPLE_SIZE


def test_turns_are_fair_and_newcomers_wait() -> None:
    pulls, winners = CrowdPulls(0), Counter[tuple[int, int, int]]()
    for turn in range(1, 401):
        for now in (turn * TURN_US - 1, turn * TURN_US + 1_000):
            for key in range(4):
                pulls.pull(key, (key / 10, 0.0, 0.0), now)
        pulls.pull(1_000 + turn, (-0.9, 0.0, 0.0), turn * TURN_US + 500)
        candidate = pulls.summarise(turn * TURN_US + 1_000).turn
        assert candidate is not None
        assert not candidate.is_newcomer
        winners[candidate.point] += 1
        pulls.leave(1_000 + turn)
        for key in range(4):
            pulls.pull(key, (key / 10, 0.0, 0.0), turn * TURN_US + 2_000)
            pulls.leave(key)
            pulls.pull(key, (key / 10, 0.0, 0.0), (turn + 1) * TURN_US - 10)
    assert len(winners) == 4
    assert min(winners.values()) > 60
