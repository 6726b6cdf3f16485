from __future__ import annotations

import pytest

from bunraku.session.notices import RATE
from bunraku.session.visitor import QUEUE, Visitor
from bunraku.wire.messages import Notice, unpack


def test_a_second_of_messages_may_come_at_once_and_then_as_fast_as_time_passes() -> None:
    one = Visitor()
    now = 10**15
    assert sum(one.may_speak(now) for _ in range(10_000)) == RATE
    assert sum(one.may_speak(now + step * 100) for step in range(1, 10_001)) == pytest.approx(RATE, abs=1)
    assert sum(one.may_speak(now + 10**8) for _ in range(10_000)) == RATE


def test_one_who_does_not_listen_is_marked() -> None:
    one = Visitor()
    for _ in range(QUEUE):
        one.tell(b"x")
    marked = [one.overrun]
    one.tell(b"x")
    assert [*marked, one.overrun] == [False, True]
    assert len(one.waiting) == QUEUE


def test_a_message_of_no_bytes_says_that_the_stage_knows_them_no_more() -> None:
    one = Visitor()
    one.tell(b"x")
    assert (one.gone, one.wake.is_set()) == (False, True)
    one.tell(b"")
    assert (one.gone, list(one.waiting)) == (True, [b"x"])


def test_what_was_dropped_is_told_of() -> None:
    one = Visitor()
    for now in (5, 6):
        one.notice(2, "rate", now)
    (told,) = one.waiting
    notice = unpack(told)
    assert isinstance(notice, Notice)
    assert (notice.limb, notice.reason) == (2, "rate")
    assert str(RATE) in notice.detail
