"""Many clients in one cheap process: they read what comes and count it, so that a bench measures who sends.

`python -m tests.bench.fanout_drain PORT VIEWERS SPEECH [PATH]`: connects, says `ready`, and for each line of standard
input prints one JSON object: the `bytes` and `frames` that came since the line before, and how many sockets are `open`.
SPEECH is `raw` (frames without a handshake), `bunraku`, `websocket`, `socketio` or `nats`. Pings are answered.
"""

from __future__ import annotations

import base64
import json
import os
import select
import socket
import sys
from dataclasses import dataclass, field

from bunraku.wire.messages import SUBPROTOCOL


def encode_masked_frame(opcode: int, payload: bytes) -> bytes:
    """A client's frame of less than 126 bytes (RFC 6455, section 5.2); its mask is zero."""
    return bytes((0x80 | opcode, 0x80 | len(payload), 0, 0, 0, 0)) + payload


@dataclass(slots=True)
class DrainClient:
    """One client: its socket, what came of a frame that is not whole yet, and bytes of the body still to come."""

    socket: socket.socket
    partial_frame: bytes = b""
    remaining_body_bytes: int = 0


@dataclass
class DrainPool:
    """All clients of the process."""

    protocol: str
    clients: dict[int, DrainClient] = field(default_factory=dict)
    received_bytes: int = 0
    frames: int = 0

    def open(self, port: int, path: str) -> int:
        """One more client, its handshake done; its socket's number."""
        connection = socket.create_connection(("127.0.0.1", port), timeout=30)
        client = DrainClient(connection)
        if self.protocol != "raw":
            key = base64.b64encode(os.urandom(16)).decode()
            lines = [f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade"]
            lines += [f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
            if self.protocol == "bunraku":
                lines.append(f"Sec-WebSocket-Protocol: {SUBPROTOCOL}")
            connection.sendall("\r\n".join([*lines, "", ""]).encode())
            answer = b""
            while b"\r\n\r\n" not in answer:
                part = connection.recv(4096)
                if not part:
                    break
                answer += part
            head, _, rest = answer.partition(b"\r\n\r\n")
            if b" 101 " not in head.split(b"\r\n", 1)[0]:
                raise ConnectionError(head.decode(errors="replace"))
            if self.protocol == "socketio":
                connection.sendall(encode_masked_frame(1, b"40"))
            if self.protocol == "nats":
                connection.sendall(
                    encode_masked_frame(2, b'CONNECT {"verbose":false,"pedantic":false}\r\nSUB overlay 1\r\n')
                )
            self.process_frames(client, rest)
        connection.setblocking(False)
        self.clients[connection.fileno()] = client
        return connection.fileno()

    def process_frames(self, client: DrainClient, data: bytes) -> None:
        """Count the frames in what came, and answer the pings."""
        at, end = client.remaining_body_bytes, len(data)
        if at >= end:
            client.remaining_body_bytes -= end
            return
        if client.partial_frame:
            data, client.partial_frame = client.partial_frame + data[at:], b""
            at, end = 0, len(data)
        while at < end:
            if end - at < 10 and (end - at < 2 or end - at < {126: 4, 127: 10}.get(data[at + 1], 2)):
                client.partial_frame, client.remaining_body_bytes = data[at:], 0
                return
            size, body = data[at + 1], at + 2
            if size == 126:
                size, body = int.from_bytes(data[at + 2 : at + 4], "big"), at + 4
            elif size == 127:
                size, body = int.from_bytes(data[at + 2 : at + 10], "big"), at + 10
            if data[at] == 0x89:
                if body + size > end:
                    client.partial_frame, client.remaining_body_bytes = data[at:], 0
                    return
                client.socket.send(encode_masked_frame(10, data[body : body + size]))
            self.frames += 1
            at = body + size
        client.remaining_body_bytes = at - end

    def read_client(self, number: int, buffer: bytearray) -> None:
        """Read what a socket holds."""
        client = self.clients[number]
        try:
            size = client.socket.recv_into(buffer)
        except BlockingIOError:
            return
        except ConnectionError:
            size = 0
        if size == 0:
            client.socket.close()
            del self.clients[number]
            return
        self.received_bytes += size
        self.process_frames(client, bytes(memoryview(buffer)[:size]))


def main() -> None:
    port, viewers, speech = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    path = sys.argv[4] if len(sys.argv) > 4 else "/"
    drains = DrainPool(speech)
    waiting = select.epoll()
    buffer = bytearray(1 << 16)
    for _ in range(viewers):
        waiting.register(drains.open(port, path), select.EPOLLIN)
        # those who have joined are viewers already
        for number, _ in waiting.poll(0):
            drains.read_client(number, buffer)
    print("ready", flush=True)
    waiting.register(0, select.EPOLLIN)
    while True:
        for number, _ in waiting.poll():
            if number:
                drains.read_client(number, buffer)
            elif not os.read(0, 64):
                return
            else:
                said = {"bytes": drains.received_bytes, "frames": drains.frames, "open": len(drains.clients)}
                drains.received_bytes = drains.frames = 0
                print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main()
