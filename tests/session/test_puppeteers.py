from __future__ import annotations

import pytest

from bunraku.session import puppeteers
from bunraku.session.puppeteers import NOTICE_EVERY, QUEUE, RATE, Full, Puppeteer, Puppeteers
from bunraku.wire.messages import Notice, unpack


def test_colours_are_the_first_free_ones_and_a_stage_is_full_some_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteers, "MOST", 3)
    here = Puppeteers()
    one, two, three = (here.join(name) for name in "abc")
    assert [p.colour for p in here] == [0, 1, 2]
    with pytest.raises(Full, match="3"):
        here.join("d")
    here.leave(two)
    assert here.join("e").colour == 1
    assert len(here) == 3
    here.tell(one.id, b"x")
    here.tell(two.id, b"y")
    assert (list(one.waiting), list(two.waiting), list(three.waiting)) == ([b"x"], [], [])


def test_a_second_of_messages_may_come_at_once_and_then_as_fast_as_time_passes() -> None:
    one = Puppeteer("a", "A", 0)
    now = 10**15
    assert sum(one.may_speak(now) for _ in range(10_000)) == RATE
    assert sum(one.may_speak(now + step * 100) for step in range(1, 10_001)) == pytest.approx(RATE, abs=1)
    assert sum(one.may_speak(now + 10**8) for _ in range(10_000)) == RATE


def test_notices_come_once_a_second_for_each_reason_and_limb() -> None:
    one = Puppeteer("a", "A", 0)
    for now in (5, 6, 5 + NOTICE_EVERY):
        for limb in (0, 1):
            one.notice(limb, "rate", now)
    told = [m for m in map(unpack, one.waiting) if isinstance(m, Notice)]
    assert [m.limb for m in told] == [0, 1, 0, 1]
    assert {m.reason for m in told} == {"rate"}
    assert "right hand" in told[1].detail


def test_one_who_does_not_listen_is_marked() -> None:
    one = Puppeteer("a", "A", 0)
    for _ in range(QUEUE):
        one.tell(b"x")
    marked = [one.overrun]
    one.tell(b"x")
    assert [*marked, one.overrun] == [False, True]
    assert len(one.waiting) == QUEUE
