from __future__ import annotations

import pytest

from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S
from bunraku.session.puppeteer_connection import MAX_QUEUED_MESSAGES, PuppeteerConnection
from bunraku.wire.messages import Notice, unpack


def test_a_second_of_messages_may_come_at_once_and_then_as_fast_as_time_passes() -> None:
    one = PuppeteerConnection()
    now = 10**15
    assert sum(one.may_send(now) for _ in range(10_000)) == MAX_MESSAGES_PER_S
    assert sum(one.may_send(now + step * 100) for step in range(1, 10_001)) == pytest.approx(MAX_MESSAGES_PER_S, abs=1)
    assert sum(one.may_send(now + 10**8) for _ in range(10_000)) == MAX_MESSAGES_PER_S


def test_full_send_queue_marks_the_connection_overrun() -> None:
    one = PuppeteerConnection()
    for _ in range(MAX_QUEUED_MESSAGES):
        one.send(b"x")
    marked = [one.is_overrun]
    one.send(b"x")
    assert [*marked, one.is_overrun] == [False, True]
    assert len(one.queued) == MAX_QUEUED_MESSAGES


def test_a_message_of_no_bytes_says_that_the_stage_knows_them_no_more() -> None:
    one = PuppeteerConnection()
    one.send(b"x")
    assert (one.is_unknown, one.has_messages.is_set()) == (False, True)
    one.send(b"")
    assert (one.is_unknown, list(one.queued)) == (True, [b"x"])


def test_dropped_input_sends_a_notice() -> None:
    one = PuppeteerConnection()
    for now in (5, 6):
        one.send_notice(2, "rate", now)
    (told,) = one.queued
    notice = unpack(told)
    assert isinstance(notice, Notice)
    assert (notice.limb, notice.reason) == (2, "rate")
    assert str(MAX_MESSAGES_PER_S) in notice.detail
