from __future__ import annotations

from bunraku.backing.frames import frame, message
from bunraku.stream.pending import PINGS, QUEUE, Pending
from bunraku.wire.messages import Ping, Pong, unpack


def test_what_waits_is_taken_once_and_in_its_order() -> None:
    pending = Pending()
    assert not pending
    for name in (b"a", b"b"):
        assert pending.put(frame(name))
    pending.overlay = frame(b"old")
    pending.overlay = frame(b"new")
    assert pending
    assert pending.control() == [frame(b"a"), frame(b"b")]
    assert pending
    assert pending.take_overlay() == frame(b"new")
    assert not pending
    assert (pending.control(), pending.take_overlay(), pending.answers()) == ([], None, [])


def test_there_is_room_for_so_many_and_again_when_they_are_taken() -> None:
    pending = Pending()
    assert all(pending.put(b"x") for _ in range(QUEUE))
    assert not pending.put(b"y")
    assert pending.control() == [b"x"] * QUEUE
    assert pending.put(b"y")


def test_answers_tell_when_the_ping_came_and_when_they_leave() -> None:
    pending = Pending()
    for number in range(PINGS + 3):
        pending.ask(Ping(number, 7), 1_000 + number)
    assert pending
    answers = [unpack(message(framed)) for framed in pending.answers()]
    assert len(answers) == PINGS
    for number, answer in enumerate(answers):
        assert isinstance(answer, Pong)
        assert (answer.sequence, answer.sent, answer.received) == (number, 7, 1_000 + number)
        assert answer.answered > answer.received
    assert not pending
