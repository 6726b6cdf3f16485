"""The minimal client against the server side of `websockets`, in memory and over real sockets."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.server import ServerConnection, serve
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.server import ServerProtocol
from websockets.typing import Subprotocol

from bunraku.client.message_socket import MessageSocket
from bunraku.wire.messages import SUBPROTOCOL
from tests.time_limit import HANG_TIMEOUT_S

URL = "ws://stage/v1/sessions/s1/stream?rate=0"


class RecordingSocket(MessageSocket):
    def __init__(self, url: str, headers: dict[str, str] | None = None) -> None:
        super().__init__(url, headers)
        self.messages: list[bytes] = []
        self.received_two = asyncio.Event()

    def on_message(self, message: bytes) -> None:
        self.messages.append(message)
        if len(self.messages) == 2:
            self.received_two.set()


class RecordingTransport(asyncio.Transport):
    """Transport in memory: the bytes written, and whether it was closed."""

    def __init__(self) -> None:
        super().__init__()
        self.written = b""
        self._closing = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self.written += data

    def take(self) -> bytes:
        data, self.written = self.written, b""
        return data

    def is_closing(self) -> bool:
        return self._closing

    def close(self) -> None:
        self._closing = True


class MemoryServer:
    """Server side of one connection in memory."""

    def __init__(self, client: MessageSocket) -> None:
        self.protocol = ServerProtocol(subprotocols=[Subprotocol(SUBPROTOCOL)], max_size=None)
        self.transport = RecordingTransport()
        client.connection_made(self.transport)
        self.protocol.receive_data(self.transport.take())
        (request,) = self.protocol.events_received()
        assert isinstance(request, Request)
        self.request = request
        self.protocol.send_response(self.protocol.accept(request))

    def take(self) -> bytes:
        return b"".join(self.protocol.data_to_send())

    def received_frames(self) -> list[Frame]:
        self.protocol.receive_data(self.transport.take())
        return [event for event in self.protocol.events_received() if isinstance(event, Frame)]


MESSAGES = st.lists(
    st.binary(min_size=1, max_size=200) | st.sampled_from([125, 126, 127, 65535, 65536]).map(lambda size: b"x" * size),
    max_size=6,
)


@given(messages=MESSAGES, cuts=st.lists(st.floats(0, 1), max_size=8))
def test_messages_arrive_whole_and_in_order_in_any_fragmentation(messages: list[bytes], cuts: list[float]) -> None:
    async def run() -> None:
        client = RecordingSocket(URL)
        server = MemoryServer(client)
        for message in messages:
            server.protocol.send_binary(message)
        data = server.take()
        for begin, end in pairwise(sorted({0, len(data), *(round(cut * len(data)) for cut in cuts)})):
            client.data_received(data[begin:end])
        assert client.messages == messages

    asyncio.run(run())


async def test_control_frames_are_answered_and_are_no_messages() -> None:
    client = RecordingSocket(URL)
    server = MemoryServer(client)
    server.protocol.send_ping(b"there?")
    client.data_received(server.take())
    (pong,) = server.received_frames()
    assert (pong.opcode, bytes(pong.data)) == (Opcode.PONG, b"there?")
    client.send(b"one", b"two")
    assert [bytes(frame.data) for frame in server.received_frames()] == [b"one", b"two"]
    server.protocol.send_close(CloseCode.GOING_AWAY)
    client.data_received(server.take())
    assert client.closed
    (close,) = server.received_frames()
    assert close.opcode is Opcode.CLOSE
    client.send(b"three")
    client.close()
    assert (server.transport.take(), client.messages) == (b"", [])


async def test_request_names_target_host_subprotocol_and_headers() -> None:
    request = MemoryServer(RecordingSocket(URL, {"Authorization": "Bearer t"})).request
    assert request.path == "/v1/sessions/s1/stream?rate=0"
    assert request.headers["Host"] == "stage"
    assert request.headers["Authorization"] == "Bearer t"
    assert request.headers["Sec-WebSocket-Protocol"] == SUBPROTOCOL


async def test_real_server_and_client_exchange_messages() -> None:
    async def echo(connection: ServerConnection) -> None:
        async for message in connection:
            await connection.send(message)

    async with (
        serve(echo, "127.0.0.1", 0, subprotocols=[Subprotocol(SUBPROTOCOL)]) as server,
        asyncio.timeout(HANG_TIMEOUT_S),
    ):
        port = next(iter(server.sockets)).getsockname()[1]
        client = RecordingSocket(f"ws://127.0.0.1:{port}/stream")
        await client.open()
        client.send(b"one", b"two")
        await client.received_two.wait()
        client.close()
    assert client.messages == [b"one", b"two"]


@pytest.mark.parametrize(
    ("response", "error"),
    [
        (b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\n\r\n", "403"),
        (b"HTTP/1.1 101", "connection"),
        (b"", "connection"),
    ],
)
async def test_rejected_handshake_is_an_error_with_its_reason(response: bytes, error: str) -> None:
    async def reject(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(response)
        writer.close()

    async with await asyncio.start_server(reject, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        async with asyncio.timeout(HANG_TIMEOUT_S):
            with pytest.raises(ConnectionError, match=error):
                await RecordingSocket(f"ws://127.0.0.1:{port}/stream").open()
