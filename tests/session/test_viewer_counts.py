from __future__ import annotations

from bunraku.session.viewer_counts import ViewerCounts


def test_silent_replicas_are_forgotten() -> None:
    now = 0
    counts = ViewerCounts(lambda: now)
    for replica, count in (("a", 3), ("b", 4), ("a", 2)):
        counts.report(replica, count)
    assert counts.total == 6
    now = 10
    counts.report("b", 4)
    counts.expire(10)
    assert counts.total == 6
    now = 11
    counts.expire(10)
    assert counts.total == 4
    counts.report("b", 0)
    assert counts.total == 0


def test_silence_does_not_count_while_the_event_loop_is_blocked() -> None:
    now = 0
    counts = ViewerCounts(lambda: now)
    counts.report("a", 1)
    now = 30
    counts.expire(10, stalled_us=25)
    assert counts.total == 1
    now = 40
    counts.expire(10)
    assert counts.total == 0
