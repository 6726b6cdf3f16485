"""Many minimal clients in one process, which read and count frames, so that a benchmark measures the sender.

`python -m tests.bench.fanout_drain PORT VIEWERS PROTOCOL [PATH]`: connects, prints `ready`, and for each line of
standard input prints one JSON object: the `bytes` and `frames` received since the last line, and the number of `open`
sockets. PROTOCOL is `raw` (frames without a handshake), `bunraku`, `websocket`, `socketio` or `nats`. Pings are
answered.
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
    """Encode a client's frame of less than 126 bytes with a mask of zero (RFC 6455, section 5.2)."""
    return bytes((0x80 | opcode, 0x80 | len(payload), 0, 0, 0, 0)) + payload


@dataclass(slots=True)
class DrainClient:
    """One client: its socket, an incomplete frame header, and the outstanding bytes of a frame body."""

    socket: socket.socket
    partial_frame: bytes = b""
    remaining_body_bytes: int = 0


@dataclass
class DrainPool:
    """The clients of the process."""

    protocol: str
    clients: dict[int, DrainClient] = field(default_factory=dict)
    received_bytes: int = 0
    frames: int = 0

    def open(self, port: int, path: str) -> int:
        """Connect one more client and do its handshake; return the file descriptor of its socket."""
        connection = socket.create_connection(("127.0.0.1", port), timeout=30)
        client = DrainClient(connection)
        if self.protocol != "raw":
            key = base64.b64encode(os.urandom(16)).decode()
            lines = [f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade"]
            lines += [f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
            if self.protocol == "bunraku":
                lines.append(f"Sec-WebSocket-Protocol: {SUBPROTOCOL}")
            connection.sendall("\r\n".join([*lines, "", ""]).encode())
            response = b""
            while b"\r\n\r\n" not in response:
                data = connection.recv(4096)
                if not data:
                    break
                response += data
            head, _, rest = response.partition(b"\r\n\r\n")
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
        """Count the frames in received bytes and answer pings."""
        offset, end = client.remaining_body_bytes, len(data)
        if offset >= end:
            client.remaining_body_bytes -= end
            return
        if client.partial_frame:
            data, client.partial_frame = client.partial_frame + data[offset:], b""
            offset, end = 0, len(data)
        while offset < end:
            if end - offset < 10 and (end - offset < 2 or end - offset < {126: 4, 127: 10}.get(data[offset + 1], 2)):
                client.partial_frame, client.remaining_body_bytes = data[offset:], 0
                return
            size, body = data[offset + 1], offset + 2
            if size == 126:
                size, body = int.from_bytes(data[offset + 2 : offset + 4], "big"), offset + 4
            elif size == 127:
                size, body = int.from_bytes(data[offset + 2 : offset + 10], "big"), offset + 10
            if data[offset] == 0x89:
                if body + size > end:
                    client.partial_frame, client.remaining_body_bytes = data[offset:], 0
                    return
                client.socket.send(encode_masked_frame(10, data[body : body + size]))
            self.frames += 1
            offset = body + size
        client.remaining_body_bytes = offset - end

    def read_client(self, descriptor: int, buffer: bytearray) -> None:
        """Read and process the data available at a client's socket."""
        client = self.clients[descriptor]
        try:
            size = client.socket.recv_into(buffer)
        except BlockingIOError:
            return
        except ConnectionError:
            size = 0
        if size == 0:
            client.socket.close()
            del self.clients[descriptor]
            return
        self.received_bytes += size
        self.process_frames(client, bytes(memoryview(buffer)[:size]))


def main() -> None:
    port, viewers, protocol = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    path = sys.argv[4] if len(sys.argv) > 4 else "/"
    pool = DrainPool(protocol)
    poller = select.epoll()
    buffer = bytearray(1 << 16)
    for _ in range(viewers):
        poller.register(pool.open(port, path), select.EPOLLIN)
        # the clients connected so far are viewers already
        for descriptor, _ in poller.poll(0):
            pool.read_client(descriptor, buffer)
    print("ready", flush=True)
    poller.register(0, select.EPOLLIN)
    while True:
        for descriptor, _ in poller.poll():
            if descriptor:
                pool.read_client(descriptor, buffer)
            elif not os.read(0, 64):
                return
            else:
                counts = {"bytes": pool.received_bytes, "frames": pool.frames, "open": len(pool.clients)}
                pool.received_bytes = pool.frames = 0
                print(json.dumps(counts), flush=True)


if __name__ == "__main__":
    main()
