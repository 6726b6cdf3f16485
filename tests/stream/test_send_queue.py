from __future__ import annotations

from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, MAX_PENDING_PINGS, SendQueue
from bunraku.websocket.frame import encode_frame, frame_payload
from bunraku.wire.messages import Ping, Pong, unpack


def test_what_waits_is_taken_once_and_in_its_order() -> None:
    pending = SendQueue()
    assert not pending
    for name in (b"a", b"b"):
        assert pending.add_control(encode_frame(name))
    pending.overlay = encode_frame(b"old")
    pending.overlay = encode_frame(b"new")
    assert pending
    assert pending.take_control() == [encode_frame(b"a"), encode_frame(b"b")]
    assert pending
    assert pending.take_overlay() == encode_frame(b"new")
    assert not pending
    assert (pending.take_control(), pending.take_overlay(), pending.take_pongs()) == ([], None, [])


def test_there_is_room_for_so_many_and_again_when_they_are_taken() -> None:
    pending = SendQueue()
    assert all(pending.add_control(b"x") for _ in range(MAX_CONTROL_MESSAGES))
    assert not pending.add_control(b"y")
    assert pending.take_control() == [b"x"] * MAX_CONTROL_MESSAGES
    assert pending.add_control(b"y")


def test_answers_tell_when_the_ping_came_and_when_they_leave() -> None:
    pending = SendQueue()
    for number in range(MAX_PENDING_PINGS + 3):
        pending.add_ping(Ping(number, 7), 1_000 + number)
    assert pending
    answers = [unpack(frame_payload(framed)) for framed in pending.take_pongs()]
    assert len(answers) == MAX_PENDING_PINGS
    for number, answer in enumerate(answers):
        assert isinstance(answer, Pong)
        assert (answer.sequence, answer.sent, answer.received) == (number, 7, 1_000 + number)
        assert answer.answered > answer.received
    assert not pending
