"""nats-server's WebSocket as a sender of `make bench-fanout`: `python -m tests.bench.fanout_nats BYTES HERTZ`.

The commands are those of `fanout_senders`. Messages are published through one TCP connection of this process, as by a
service; `cpu` is that of the server alone.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tests.processes import ServerProcess, find_program, free_port

SUBJECT = "overlay"


def server_config(client: int, websocket: int, monitor: int) -> str:
    """Return a configuration with which the server sends no pings during a benchmark."""
    return f"""
host: "127.0.0.1"
port: {client}
http: "127.0.0.1:{monitor}"
ping_interval: "1h"
websocket {{
  host: "127.0.0.1"
  port: {websocket}
  no_tls: true
  compression: false
}}
"""


def connect_publisher(port: int) -> socket.socket:
    """Connect a client that may publish."""
    client = socket.create_connection(("127.0.0.1", port), timeout=10)
    client.sendall(b'CONNECT {"verbose":false,"pedantic":false}\r\nPING\r\n')
    received = b""
    while b"PONG\r\n" not in received:
        received += client.recv(4096)
    return client


def sent_messages(monitor: int) -> int:
    """Return the number of messages that the server has sent to clients, by its own counter."""
    with socket.create_connection(("127.0.0.1", monitor), timeout=10) as connection:
        connection.sendall(b"GET /varz HTTP/1.0\r\n\r\n")
        received = b"".join(iter(lambda: connection.recv(1 << 16), b""))
    counters: Any = json.loads(received.partition(b"\r\n\r\n")[2])
    return int(counters["out_msgs"])


def processor_seconds_of(pid: int) -> float:
    """Return the CPU time of the server, seconds, at nanosecond resolution, without threads that have ended."""
    return sum(int(one.read_text().split()[0]) for one in Path(f"/proc/{pid}/task").glob("*/schedstat")) / 1e9


def main() -> None:
    size, hertz = int(sys.argv[1]), int(sys.argv[2])
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        client, websocket, monitor = free_port(), free_port(), free_port()
        config = Path(folder) / "nats.conf"
        config.write_text(server_config(client, websocket, monitor))
        server = ServerProcess([find_program("nats-server"), "-c", str(config)], client, Path(folder))
        server.start()
        try:
            publisher = connect_publisher(client)
            print(websocket, flush=True)
            message = f"PUB {SUBJECT} {size}\r\n".encode() + os.urandom(size) + b"\r\n"
            while line := sys.stdin.readline():
                messages, before, begun = sent_messages(monitor), processor_seconds_of(server.pid), time.monotonic()
                for tick in range(round(float(line) * hertz)):
                    time.sleep(max(begun + tick / hertz - time.monotonic(), 0.0))
                    publisher.sendall(message)
                time.sleep(1 / hertz)
                cpu = processor_seconds_of(server.pid) - before
                print(json.dumps({"messages": sent_messages(monitor) - messages, "cpu": round(cpu, 6)}), flush=True)
        finally:
            server.stop()


if __name__ == "__main__":
    main()
