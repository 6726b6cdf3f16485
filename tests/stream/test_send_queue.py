from __future__ import annotations

from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, MAX_PENDING_PINGS, SendQueue
from bunraku.websocket.frame import encode_frame, frame_payload
from bunraku.wire.live import Live
from bunraku.wire.messages import Ping, Pong, unpack
from bunraku.wire.overlay import Overlay


def test_queued_messages_are_taken_once_and_in_order() -> None:
    queue = SendQueue(lambda: 0)
    assert not queue
    for name in (b"a", b"b"):
        assert queue.add_control(encode_frame(name))
    old, new, live = Overlay(1, 1, {}).pack(), Overlay(2, 2, {4: (0,) * 9}).pack(), Live(1, 1, {}).pack()
    had_newest = queue.has_newest
    assert [queue.put_newest(encode_frame(message)) for message in (old, live, new, live)] == [False, False, True, True]
    assert (had_newest, queue.has_newest) == (False, True)
    assert queue
    assert queue.take_control() == [encode_frame(b"a"), encode_frame(b"b")]
    assert queue
    assert [queue.take_newest(), queue.take_newest()] == [encode_frame(new), encode_frame(live)]
    assert not queue
    assert (queue.take_control(), queue.take_newest(), queue.take_pongs()) == ([], None, [])


def test_full_queue_rejects_messages_until_taken() -> None:
    queue = SendQueue(lambda: 0)
    assert all(queue.add_control(b"x") for _ in range(MAX_CONTROL_MESSAGES))
    assert not queue.add_control(b"y")
    assert queue.take_control() == [b"x"] * MAX_CONTROL_MESSAGES
    assert queue.add_control(b"y")


def test_pong_holds_times_of_receipt_and_sending() -> None:
    queue = SendQueue(lambda: 5_000)
    for number in range(MAX_PENDING_PINGS + 3):
        queue.add_ping(Ping(number, 7), 1_000 + number)
    assert queue
    pongs = [unpack(frame_payload(framed)) for framed in queue.take_pongs()]
    assert pongs == [Pong(number, 7, 1_000 + number, 5_000) for number in range(MAX_PENDING_PINGS)]
    assert not queue
