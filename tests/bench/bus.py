"""Latency of the bus between two processes: `make bench-bus`. Needs nats-server.

The last line printed is one JSON object. Each row of the table is the overlays of a number of publishers, 66 bytes at
20 Hz per session, through one nats-server on loopback; each process has an event loop like the services. For
comparison, in alternation: a bare socket between the same two processes, and the in-process bus. Reported are the
median of the rounds, and the p99 of the best round, which excludes other load of the machine.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import socket
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import cast

import uvloop

from bunraku.messaging.bus import Bus, MemoryBus
from bunraku.messaging.bus_nats import NatsBus
from tests.bench.fanout_processes import LineProcess
from tests.processes import nats_url_of, run_nats_server

MESSAGE_RATE_HZ = 20
MESSAGE_BYTES = 66
SESSION_COUNTS = (1, 50, 200)


class LatencyRecorder:
    """Latencies of messages, seconds; each message begins with the time of its publication."""

    def __init__(self) -> None:
        self.latencies_s: list[float] = []

    def __call__(self, message: bytes) -> None:
        self.latencies_s.append((time.monotonic_ns() - int.from_bytes(message[:8], "little")) * 1e-9)


async def publish_overlays(bus: Bus, sessions: int, seconds: float) -> int:
    """Publish the overlays of `sessions` sessions at staggered times; return the number of messages."""
    begun = time.monotonic()
    total = round(seconds * MESSAGE_RATE_HZ) * sessions
    for number in range(total):
        wait = begun + number / (MESSAGE_RATE_HZ * sessions) - time.monotonic()
        if wait > 0:
            await asyncio.sleep(wait)
        data = time.monotonic_ns().to_bytes(8, "little") + bytes(MESSAGE_BYTES - 8)
        bus.publish(f"session.{number % sessions}.overlay", data)
    return total


class SocketReceiver(asyncio.Protocol):
    """Protocol of a bare socket that carries messages of `MESSAGE_BYTES`, the counterpart of `Bus.publish`."""

    def __init__(self, recorder: LatencyRecorder | None = None) -> None:
        self._recorder, self._unread = recorder, b""
        self.transport: asyncio.Transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        assert self._recorder is not None
        self._unread += data
        while len(self._unread) >= MESSAGE_BYTES:
            self._recorder(self._unread[:MESSAGE_BYTES])
            self._unread = self._unread[MESSAGE_BYTES:]


async def run_listener(url: str) -> None:
    """Subscribe to all sessions in the other process; print the latencies so far for each line of standard input."""
    loop = asyncio.get_running_loop()
    recorder = LatencyRecorder()
    bus = NatsBus(url)
    await bus.open()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        plain_socket = await loop.create_server(lambda: SocketReceiver(recorder), sock=listening)
        for number in range(max(SESSION_COUNTS)):
            bus.subscribe(f"session.{number}.overlay", recorder)

        async def ready(_: bytes) -> bytes:
            return b""

        bus.serve("ready", ready)
        # the subscriptions are active once this request is answered
        await bus.request("ready")
        print(listening.getsockname()[1], flush=True)
        while await asyncio.to_thread(sys.stdin.readline):
            print(json.dumps(recorder.latencies_s), flush=True)
            recorder.latencies_s.clear()
        plain_socket.close()


async def _measure_round(
    bus: Bus, sessions: int, seconds: float, receiver: LatencyRecorder | LineProcess
) -> list[float]:
    """Publish for one round and return the latencies of its messages."""
    sent = await publish_overlays(bus, sessions, seconds)
    await asyncio.sleep(0.3)
    if isinstance(receiver, LineProcess):
        latencies: list[float] = await asyncio.to_thread(receiver.request, "")
    else:
        latencies, receiver.latencies_s = receiver.latencies_s, []
    assert len(latencies) == sent, f"{len(latencies)} of {sent} messages arrived"
    return latencies


async def measure_buses(url: str, listener: LineProcess, seconds: float, rounds: int) -> dict[str, float]:
    """Measure and print every row of the table; return the figures."""
    figures: dict[str, float] = {}
    bus = NatsBus(url)
    await bus.open()
    port = int(listener.read_line())
    _, plain_socket = await asyncio.get_running_loop().create_connection(SocketReceiver, "127.0.0.1", port)

    class Socket(MemoryBus):
        def publish(self, _: str, data: bytes) -> None:
            plain_socket.transport.write(data)

    memory, memory_recorder = MemoryBus(), LatencyRecorder()
    for number in range(max(SESSION_COUNTS)):
        memory.subscribe(f"session.{number}.overlay", memory_recorder)
    buses: list[tuple[str, Bus]] = [("nats", bus), ("socket", Socket()), ("memory", memory)]
    found: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for round_number in range(rounds + 1):
        for sessions in SESSION_COUNTS:
            for name, transport in buses:
                latencies = await _measure_round(
                    transport, sessions, seconds, memory_recorder if name == "memory" else listener
                )
                cuts = statistics.quantiles(latencies, n=100)
                if round_number:
                    found.setdefault((name, sessions), []).append((cuts[49] * 1e3, cuts[98] * 1e3))
    print(f"{'':24}{'messages/s':>12}{'p50 ms':>10}{'p99 ms':>10}{'best p99':>10}")
    for (name, sessions), rounds_of_bus in found.items():
        p50, p99 = (statistics.median(values) for values in zip(*rounds_of_bus, strict=True))
        best = min(value for _, value in rounds_of_bus)
        print(
            f"{name}, {sessions} sessions".ljust(24)
            + f"{sessions * MESSAGE_RATE_HZ:12}{p50:10.3f}{p99:10.3f}{best:10.3f}"
        )
        figures |= {f"{name}_{sessions}_ms_p50": round(p50, 3), f"{name}_{sessions}_ms_p99": round(p99, 3)}
        figures[f"{name}_{sessions}_ms_p99_best"] = round(best, 3)
    publish_count = 20_000
    before = time.process_time()
    for _ in range(20):
        for _ in range(publish_count // 20):
            bus.publish("nobody.listens", bytes(MESSAGE_BYTES))
        await asyncio.sleep(0.05)
    figures["publish_us"] = round((time.process_time() - before) / publish_count * 1e6, 2)
    print(f"CPU time per publication: {figures['publish_us']} us")
    await bus.close()
    return figures


def main() -> None:
    """Run the benchmark, or its other process."""
    if sys.argv[1:2] == ["listen"]:
        uvloop.run(run_listener(sys.argv[2]))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="seconds per row and round")
    parser.add_argument("--rounds", type=int, default=7, help="number of rounds, of which the median is reported")
    options = parser.parse_args()
    with (
        tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder,
        run_nats_server(Path(folder)) as server,
        LineProcess.start_module("bus", "listen", nats_url_of(server)) as other,
    ):
        figures = uvloop.run(measure_buses(nats_url_of(server), other, options.seconds, options.rounds))
    print(json.dumps({"bench": "bus", **figures}))


if __name__ == "__main__":
    main()
