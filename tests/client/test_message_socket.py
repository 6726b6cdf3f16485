from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.client.message_socket import MessageSocket, upgrade_request

UPGRADE_RESPONSE = b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n\r\n"
URL = "ws://stage/v1/sessions/s1/stream?rate=0"


class RecordingSocket(MessageSocket):
    def __init__(self, url: str) -> None:
        super().__init__(url)
        self.messages: list[bytes] = []

    def on_message(self, message: bytes) -> None:
        self.messages.append(message)


class RecordingTransport(asyncio.Transport):
    """The system's side of a connection: what was written, and whether it was closed."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self._closing = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.written += data

    def is_closing(self) -> bool:
        return self._closing

    def close(self) -> None:
        self._closing = True


def frame(opcode: int, payload: bytes) -> bytes:
    """A server's (RFC 6455, section 5.2)."""
    size = len(payload)
    if size < 126:
        return bytes((0x80 | opcode, size)) + payload
    wide, mark = (2, 126) if size < 1 << 16 else (8, 127)
    return bytes((0x80 | opcode, mark)) + size.to_bytes(wide, "big") + payload


MESSAGES = st.lists(
    st.binary(min_size=1, max_size=200) | st.sampled_from([125, 126, 127, 65535, 65536]).map(lambda size: b"x" * size),
    max_size=6,
)


@given(messages=MESSAGES, cuts=st.lists(st.floats(0, 1), max_size=8))
def test_messages_come_whole_and_in_order_in_whatever_pieces_they_arrive(
    messages: list[bytes], cuts: list[float]
) -> None:
    data = UPGRADE_RESPONSE + b"".join(frame(2, message) for message in messages)
    places = sorted({0, len(data), *(round(cut * len(data)) for cut in cuts)})

    async def run() -> None:
        kept = RecordingSocket(URL)
        kept.connection_made(RecordingTransport())
        for begin, end in pairwise(places):
            kept.data_received(data[begin:end])
        assert kept.messages == messages

    asyncio.run(run())


async def test_what_sockets_ask_of_each_other_is_answered_and_is_no_message() -> None:
    kept, wire = RecordingSocket(URL), RecordingTransport()
    kept.connection_made(wire)
    wire.written = b""
    kept.data_received(UPGRADE_RESPONSE + frame(9, b"there?"))
    assert wire.written == bytes((0x8A, 0x86, 0, 0, 0, 0)) + b"there?"
    wire.written = b""
    kept.send(b"one", b"two")
    assert wire.written == b"".join(bytes((0x82, 0x83, 0, 0, 0, 0)) + message for message in (b"one", b"two"))
    kept.data_received(frame(8, (1001).to_bytes(2, "big")))
    assert kept.closed
    assert wire.is_closing()
    wire.written = b""
    kept.send(b"three")
    kept.close()
    assert (wire.written, kept.messages) == (b"", [])


def test_its_request_names_the_target_the_host_and_what_else_it_is_given() -> None:
    lines = upgrade_request(URL, {"Authorization": "Bearer t"}).decode().split("\r\n")
    assert lines[:2] == ["GET /v1/sessions/s1/stream?rate=0 HTTP/1.1", "Host: stage"]
    assert lines[-3:] == ["Authorization: Bearer t", "", ""]
    assert "Sec-WebSocket-Protocol: bunraku.v1" in lines
    assert upgrade_request(URL) != upgrade_request(URL), "a key is used once (RFC 6455, section 4.1)"


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (b"HTTP/1.1 403 Forbidden\r\n\r\n", "403 Forbidden"),
        (b"HTTP/1.1 101", "closed the connection"),
        (b"", "closed the connection"),
    ],
)
async def test_a_server_that_will_not_talk_is_an_error_that_says_why(answer: bytes, says: str) -> None:
    async def refuse(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(answer)
        writer.close()

    async with await asyncio.start_server(refuse, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        async with asyncio.timeout(20):
            with pytest.raises(ConnectionError, match=says):
                await RecordingSocket(f"ws://127.0.0.1:{port}/stream").open()
