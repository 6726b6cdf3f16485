"""From the publishing of a message to its handler in another process: `make bench-bus`. Needs nats-server.

The last line printed is one JSON object. A line of the table is some publishers' worth of overlays, 66 bytes twenty
times a second of each session, through one nats-server on loopback; each process has a loop as the services have it.
Beside it, in turns, a bare socket between the same two processes, and the bus within a process. The median of the
rounds is told, and the p99 of the best one: what else the machine does is in the others.
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
    """How long messages were on the way, seconds: each begins with the instant of its publishing."""

    def __init__(self) -> None:
        self.latencies_s: list[float] = []

    def __call__(self, message: bytes) -> None:
        self.latencies_s.append((time.monotonic_ns() - int.from_bytes(message[:8], "little")) * 1e-9)


async def publish_overlays(bus: Bus, sessions: int, seconds: float) -> int:
    """Publish as so many stages do, each at instants of its own; how many messages."""
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
    """A socket that carries messages of `BYTES` and nothing else, as `Bus.publish` would."""

    def __init__(self, heard: LatencyRecorder | None = None) -> None:
        self._recorder, self._unread = heard, b""
        self.transport: asyncio.Transport

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """As asyncio has it."""
        self.transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        """As asyncio has it."""
        assert self._recorder is not None
        self._unread += data
        while len(self._unread) >= MESSAGE_BYTES:
            self._recorder(self._unread[:MESSAGE_BYTES])
            self._unread = self._unread[MESSAGE_BYTES:]


async def run_listener(url: str) -> None:
    """The other process: listens to all sessions, and says how late messages were for each line that it is told."""
    loop = asyncio.get_running_loop()
    heard = LatencyRecorder()
    bus = NatsBus(url)
    await bus.open()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        bare = await loop.create_server(lambda: SocketReceiver(heard), sock=listening)
        for number in range(max(SESSION_COUNTS)):
            bus.subscribe(f"session.{number}.overlay", heard)

        async def ready(_: bytes) -> bytes:
            return b""

        bus.serve("ready", ready)
        # what was said before holds once this is answered
        await bus.request("ready")
        print(listening.getsockname()[1], flush=True)
        while await asyncio.to_thread(sys.stdin.readline):
            print(json.dumps(heard.latencies_s), flush=True)
            heard.latencies_s.clear()
        bare.close()


async def _measure_round(
    bus: Bus, sessions: int, seconds: float, receiver: LatencyRecorder | LineProcess
) -> list[float]:
    """How late messages were in one round."""
    sent = await publish_overlays(bus, sessions, seconds)
    await asyncio.sleep(0.3)
    if isinstance(receiver, LineProcess):
        late: list[float] = await asyncio.to_thread(receiver.request, "")
    else:
        late, receiver.latencies_s = receiver.latencies_s, []
    assert len(late) == sent, f"{len(late)} of {sent} came"
    return late


async def measure_buses(url: str, listener: LineProcess, seconds: float, rounds: int) -> dict[str, float]:
    """Every line of the table."""
    figures: dict[str, float] = {}
    bus = NatsBus(url)
    await bus.open()
    port = int(listener.read_line())
    _, bare = await asyncio.get_running_loop().create_connection(SocketReceiver, "127.0.0.1", port)

    class Socket(MemoryBus):
        def publish(self, _: str, data: bytes) -> None:
            bare.transport.write(data)

    memory, inside = MemoryBus(), LatencyRecorder()
    for number in range(max(SESSION_COUNTS)):
        memory.subscribe(f"session.{number}.overlay", inside)
    ways: list[tuple[str, Bus]] = [("nats", bus), ("socket", Socket()), ("memory", memory)]
    found: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for turn in range(rounds + 1):
        for sessions in SESSION_COUNTS:
            for name, through in ways:
                late = await _measure_round(through, sessions, seconds, inside if name == "memory" else listener)
                cuts = statistics.quantiles(late, n=100)
                if turn:
                    found.setdefault((name, sessions), []).append((cuts[49] * 1e3, cuts[98] * 1e3))
    print(f"{'':24}{'messages/s':>12}{'p50 ms':>10}{'p99 ms':>10}{'best p99':>10}")
    for (name, sessions), turns in found.items():
        p50, p99 = (statistics.median(values) for values in zip(*turns, strict=True))
        best = min(value for _, value in turns)
        print(
            f"{name}, {sessions} sessions".ljust(24)
            + f"{sessions * MESSAGE_RATE_HZ:12}{p50:10.3f}{p99:10.3f}{best:10.3f}"
        )
        figures |= {f"{name}_{sessions}_ms_p50": round(p50, 3), f"{name}_{sessions}_ms_p99": round(p99, 3)}
        figures[f"{name}_{sessions}_ms_p99_best"] = round(best, 3)
    cost = 20_000
    before = time.process_time()
    for _ in range(20):
        for _ in range(cost // 20):
            bus.publish("nobody.listens", bytes(MESSAGE_BYTES))
        await asyncio.sleep(0.05)
    figures["publish_us"] = round((time.process_time() - before) / cost * 1e6, 2)
    print(f"processor time of one publishing: {figures['publish_us']} us")
    await bus.close()
    return figures


def main() -> None:
    """Measure, or be the other process."""
    if sys.argv[1:2] == ["listen"]:
        uvloop.run(run_listener(sys.argv[2]))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each line and round")
    parser.add_argument("--rounds", type=int, default=7, help="of which the median is told")
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder,
        run_nats_server(Path(folder)) as server,
        LineProcess.start_module("bus", "listen", nats_url_of(server)) as other,
    ):
        figures = uvloop.run(measure_buses(nats_url_of(server), other, given.seconds, given.rounds))
    print(json.dumps({"bench": "bus", **figures}))


if __name__ == "__main__":
    main()
