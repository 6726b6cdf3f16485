from __future__ import annotations

import h11
import pytest

from bunraku.http.request_body import MAX_SMALL_CHUNKS, MIN_CHUNK_BYTES
from bunraku.http.request_head import MAX_FIELD_BYTES, MAX_FIELDS, MAX_HEAD_BYTES, MAX_TARGET_BYTES, BoundedConnection

UPGRADE = (
    "Connection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
)


def head(*fields: str, target: str = "/", method: str = "GET") -> bytes:
    return f"{method} {target} HTTP/1.1\r\nHost: stage\r\n{''.join(fields)}\r\n".encode()


def parse(data: bytes) -> h11.Event:
    connection = BoundedConnection()
    connection.receive_data(data)
    event = connection.next_event()
    assert isinstance(event, h11.Event)
    return event


@pytest.mark.parametrize(
    "data",
    [
        head(),
        head("Content-Length: 3\r\n", method="POST"),
        head("Transfer-Encoding: chunked\r\n", method="POST") + b"1\r\nx\r\n0\r\n\r\n",
        head(UPGRADE),
        # curl offers HTTP/2 this way, also with a body
        head("Connection: Upgrade\r\nUpgrade: h2c\r\nContent-Length: 1\r\n", method="POST") + b"x",
        head() + head(),
        head(*(f"a{n}: b\r\n" for n in range(MAX_FIELDS - 1))),
        head(target="/" + "a" * (MAX_TARGET_BYTES - 1)),
    ],
)
def test_ordinary_request_is_accepted(data: bytes) -> None:
    assert isinstance(parse(data), h11.Request)


@pytest.mark.parametrize(
    ("data", "status"),
    [
        (head(*(f"a{n}: b\r\n" for n in range(MAX_FIELDS))), 431),
        (head(f"a: {'b' * MAX_FIELD_BYTES}\r\n"), 431),
        (head(*(f"a{n}: {'b' * 7_000}\r\n" for n in range(3))), 431),
        # all in one piece, so that h11 does not see an incomplete head
        (head(*(f"a{n}: {'b' * 1_200}\r\n" for n in range(90))), 431),
        (head(target="/" + "a" * MAX_TARGET_BYTES), 414),
        (head("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", method="POST") + b"0\r\n\r\n", 400),
        (head("Transfer-Encoding: chunked\r\nContent-Length: 0\r\n", method="POST") + b"0\r\n\r\n", 400),
        (head(UPGRADE, "Content-Length: 3\r\n") + b"abc", 400),
        (head(UPGRADE, "Content-Length: 0\r\n"), 400),
        (head(UPGRADE, "Transfer-Encoding: chunked\r\n") + b"0\r\n\r\n", 400),
        # frames before the response
        (head(UPGRADE) + b"\x89\x80\0\0\0\0", 400),
        (b"GET / HTTP/1.1\r\n\r\n", 400),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\r\n\r\n", 400),
    ],
)
def test_unacceptable_head_is_rejected_with_its_status(data: bytes, status: int) -> None:
    connection = BoundedConnection()
    connection.receive_data(data)
    with pytest.raises(h11.RemoteProtocolError) as rejected:
        connection.next_event()
    assert rejected.value.error_status_hint == status
    assert connection.error is rejected.value


def test_second_request_in_one_segment_is_checked_as_well() -> None:
    connection = BoundedConnection()
    connection.receive_data(head() + head(*(f"a{n}: {'b' * 2_000}\r\n" for n in range(MAX_HEAD_BYTES // 2_000 + 1))))
    assert isinstance(connection.next_event(), h11.Request)
    assert isinstance(connection.next_event(), h11.EndOfMessage)
    for event in (h11.Response(status_code=204, headers=[]), h11.EndOfMessage()):
        connection.send(event)
    connection.start_next_cycle()
    with pytest.raises(h11.RemoteProtocolError, match="at most"):
        connection.next_event()


@pytest.mark.parametrize(
    "data", [b"1;" + b"e" * 1_000 + b"\r\nx\r\n", b"0\r\n" + b"trailer: 1\r\n" * 2_000], ids=["extensions", "trailers"]
)
def test_endless_framing_of_a_body_is_rejected(data: bytes) -> None:
    connection = BoundedConnection()
    connection.receive_data(head("Transfer-Encoding: chunked\r\n", method="POST"))
    assert isinstance(connection.next_event(), h11.Request)
    with pytest.raises(h11.RemoteProtocolError):  # noqa: PT012
        for _ in range(1_000):
            connection.receive_data(data)
            while connection.next_event() is not h11.NEED_DATA:
                continue


@pytest.mark.parametrize(("chunk", "count"), [(1, MAX_SMALL_CHUNKS), (MIN_CHUNK_BYTES, 10_000), (60_000, 100)])
def test_usual_chunks_are_accepted(chunk: int, count: int) -> None:
    connection, size = BoundedConnection(), 0
    connection.receive_data(head("Transfer-Encoding: chunked\r\n", method="POST"))
    data = f"{chunk:x}\r\n".encode() + b"x" * chunk + b"\r\n"
    for _ in range(count):
        connection.receive_data(data)
        while (event := connection.next_event()) is not h11.NEED_DATA:
            size += len(event.data) if isinstance(event, h11.Data) else 0
    assert size == chunk * count


@pytest.mark.parametrize("is_chunked", [True, False])
@pytest.mark.parametrize("size", [1, MIN_CHUNK_BYTES // 2])
def test_body_in_many_small_pieces_is_rejected(size: int, is_chunked: bool) -> None:
    connection = BoundedConnection()
    framing = "Transfer-Encoding: chunked" if is_chunked else "Content-Length: 1000000"
    connection.receive_data(head(f"{framing}\r\n", method="POST"))
    assert isinstance(connection.next_event(), h11.Request)
    piece = b"%x\r\n%s\r\n" % (size, b"x" * size) if is_chunked else b"x" * size
    with pytest.raises(h11.RemoteProtocolError, match="small chunks") as raised:  # noqa: PT012
        for _ in range(3 * MAX_SMALL_CHUNKS):
            connection.receive_data(piece)
            while connection.next_event() is not h11.NEED_DATA:
                continue
    assert raised.value.error_status_hint == 400
