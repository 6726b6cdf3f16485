from __future__ import annotations

import pytest

from bunraku.session.notice_throttle import MAX_MESSAGES_PER_S
from bunraku.session.puppeteer_connection import MAX_QUEUED_MESSAGES, PuppeteerConnection
from bunraku.wire.messages import Notice, unpack


def test_message_rate_allows_a_burst_of_one_second() -> None:
    connection = PuppeteerConnection()
    now = 10**15
    assert sum(connection.may_send(now) for _ in range(10_000)) == MAX_MESSAGES_PER_S
    assert sum(connection.may_send(now + step * 100) for step in range(1, 10_001)) == pytest.approx(
        MAX_MESSAGES_PER_S, abs=1
    )
    assert sum(connection.may_send(now + 10**8) for _ in range(10_000)) == MAX_MESSAGES_PER_S


def test_full_send_queue_marks_the_connection_overrun() -> None:
    connection = PuppeteerConnection()
    for _ in range(MAX_QUEUED_MESSAGES):
        connection.send(b"x")
    states = [connection.is_overrun]
    connection.send(b"x")
    assert [*states, connection.is_overrun] == [False, True]
    assert len(connection.queued) == MAX_QUEUED_MESSAGES


def test_empty_message_marks_the_puppeteer_as_unknown() -> None:
    connection = PuppeteerConnection()
    connection.send(b"x")
    assert (connection.is_unknown, connection.has_messages.is_set()) == (False, True)
    connection.send(b"")
    assert (connection.is_unknown, list(connection.queued)) == (True, [b"x"])


def test_dropped_input_sends_a_notice() -> None:
    connection = PuppeteerConnection()
    for now in (5, 6):
        connection.send_notice(2, "rate", now)
    (message,) = connection.queued
    notice = unpack(message)
    assert isinstance(notice, Notice)
    assert (notice.limb, notice.reason) == (2, "rate")
    assert str(MAX_MESSAGES_PER_S) in notice.detail
