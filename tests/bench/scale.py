"""Costs for the capacity planning of deploy/SCALE.md that no other benchmark measures: `make bench-scale`.

The last line printed is one JSON object. `dance`: the demo motion with all tracks to many viewers of one process.
`gateway` (needs Caddy): overlays of one limb through Caddy with our Caddyfile, its CPU time per message and memory per
viewer. `origin`: blocks over HTTP on persistent connections, as a CDN fetches them. `register`: what idle sessions
cost the session replicas and NATS. `links`: requests to PostgreSQL for each client with a share link.
"""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bunraku.client import Client
from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.playout import timeline
from bunraku.session.session_registry import SessionRecord, SessionRegistry, session_key
from bunraku.storage.catalogue import Catalogue
from tests.bench.arguments import parse_parts
from tests.bench.fanout_processes import LineProcess
from tests.bench.fanout_senders import SESSION
from tests.conftest import REPOSITORY
from tests.processes import ServerProcess, cpu_seconds, free_port, nats_url_of, run_jetstream, run_postgres

Figures = dict[str, float]


@contextmanager
def start_demo() -> Iterator[tuple[LineProcess, str]]:
    """Run a complete server in a separate process with the demo; yield the process and its URL."""
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        bunraku = str(Path(sys.executable).parent / "bunraku")
        with LineProcess([bunraku, "up", "--demo", "--port", "0", "--data", folder]) as server:
            found = None
            while found is None:
                found = re.search(r"is at (http://\S+)/", server.read_line())
            # CPU time for loading after the start must not count for viewers
            used = -1.0
            while server.processor_seconds() - used > 0.1:
                used = server.processor_seconds()
                time.sleep(3)
            yield server, found[1]


async def _find_demo_session(url: str) -> tuple[str, str]:
    """Return the session and motion of the demo."""
    async with Client(url) as client:
        session = await client.first_session()
        assert session is not None
        return session, (await client.session(session))["motion"]


def measure_demo_delivery(viewers: int = 1000, seconds: float = 20.0) -> Figures:
    """Measure CPU time and bytes per viewer of a motion with sound, camera and lights."""
    with start_demo() as (server, url):
        session, _ = asyncio.run(_find_demo_session(url))
        path, port = f"/v1/sessions/{session}/stream", url.rpartition(":")[2]
        cpu_before_join, joining = server.processor_seconds(), time.monotonic()
        with LineProcess.start_module("fanout_drain", port, viewers, "bunraku", path) as drain:
            assert drain.read_line() == "ready"
            # the initial prefetch counts for the join
            time.sleep(10)
            drain.request("")
            before, begun = server.processor_seconds(), time.monotonic()
            time.sleep(seconds)
            passed, cores = time.monotonic() - begun, server.processor_seconds() - before
            received = drain.request("")
    joined = before - cpu_before_join - cores / passed * (begun - joining)
    assert received["open"] == viewers
    return {
        "dance_viewers": viewers,
        "dance_messages_viewer_second": round(received["frames"] / passed / viewers, 2),
        "dance_kbps_viewer": round(received["bytes"] * 8e-3 / passed / viewers, 1),
        "dance_join_ms": round(joined * 1e3 / viewers, 2),
        "dance_cores": round(cores / passed, 3),
        "dance_viewers_core": round(viewers * passed / cores),
    }


@contextmanager
def start_gateway(port: str) -> Iterator[tuple[LineProcess, int]]:
    """Run Caddy with our Caddyfile, all services at one local port; yield the process and its port."""
    program, own = shutil.which("caddy"), free_port()
    if program is None:
        raise RuntimeError("Caddy is not installed")
    text = (REPOSITORY / "deploy" / "Caddyfile").read_text()
    text = re.sub(r"dynamic a \w+ 8000", f"dynamic a localhost {port}", text).replace(":8079", f":{free_port()}")
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        file = Path(folder) / "Caddyfile"
        file.write_text(text)
        environment = [f"BUNRAKU_SITE=:{own}", f"XDG_DATA_HOME={folder}", f"XDG_CONFIG_HOME={folder}"]
        with LineProcess(
            ["env", *environment, program, "run", "--config", str(file), "--adapter", "caddyfile"]
        ) as caddy:
            while True:
                try:
                    socket.create_connection(("127.0.0.1", own), 1).close()
                    break
                except OSError:
                    time.sleep(0.05)
            yield caddy, own


def measure_gateway(viewers: int = 600, hertz: int = 20, seconds: float = 10.0) -> Figures:
    """Measure overlays of one limb, 66 bytes, through the gateway."""
    path = f"/v1/sessions/{SESSION}/stream"
    with (
        LineProcess.start_module("fanout_senders", "bunraku", 66, hertz) as sender,
        start_gateway(sender.read_line()) as (caddy, own),
    ):
        before = caddy.resident_kilobytes()
        with LineProcess.start_module("fanout_drain", own, viewers, "bunraku", path) as drain:
            assert drain.read_line() == "ready"
            sender.request(2)
            drain.request("")
            used = caddy.processor_seconds()
            sent = sender.request(seconds)
            cores = caddy.processor_seconds() - used
            memory = caddy.resident_kilobytes() - before
            time.sleep(0.5)
            received = drain.request("")
    assert received["open"] == viewers
    assert received["frames"] >= 0.95 * sent["messages"] > 0
    return {
        "gateway_us_message": round(cores * 1e6 / sent["messages"], 1),
        "gateway_kb_viewer": round(memory / viewers, 1),
        "stream_us_message": round(sent["cpu"] * 1e6 / sent["messages"], 1),
    }


def measure_origin(connections: int = 8, seconds: float = 8.0) -> Figures:
    """Measure the blocks per second that one process serves over HTTP, and their CPU time."""
    with start_demo() as (server, url):
        _, motion = asyncio.run(_find_demo_session(url))
        host, port = url.removeprefix("http://").split(":")
        request = f"GET /v1/motions/{motion}/blocks/4/1 HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()

        async def fetch(until: float) -> int:
            reader, writer = await asyncio.open_connection(host, int(port))
            number = 0
            while time.monotonic() < until:
                writer.write(request)
                head = await reader.readuntil(b"\r\n\r\n")
                assert b" 200 " in head[:20]
                assert b"immutable" in head
                length = re.search(rb"content-length: (\d+)", head)
                assert length is not None
                await reader.readexactly(int(length[1]))
                number += 1
            writer.close()
            return number

        async def fetch_all() -> int:
            until = time.monotonic() + seconds
            return sum(await asyncio.gather(*(fetch(until) for _ in range(connections))))

        before = server.processor_seconds()
        fetched = asyncio.run(fetch_all())
        used = server.processor_seconds() - before
    return {"origin_blocks_second": round(fetched / seconds), "origin_us_block": round(used * 1e6 / fetched)}


class CountingBus(NatsBus):
    """Bus that counts its requests."""

    requests = 0

    async def request(self, *args: Any, **options: Any) -> bytes:
        self.requests += 1
        return await super().request(*args, **options)


def measure_key_value_store(sessions: int = 1000, replicas: int = 4, seconds: float = 20.0) -> Figures:
    """Measure the requests and the CPU time of session replicas and of NATS while no session is used."""

    async def run_heartbeats(server: ServerProcess) -> Figures:
        buses = [CountingBus(nats_url_of(server)) for _ in range(replicas)]
        for bus in buses:
            await bus.open()
        stores = [NatsKeyValueStore(bus) for bus in buses]
        registries = [SessionRegistry(store) for store in stores]
        record = SessionRecord("", 1, timeline.start("m", 1_000_000, 1).pack(), "aiko")
        for number in range(sessions):
            await stores[0].put(session_key(str(number)), record.pack())
        for registry in registries:
            registry.watch(lambda _: None)
            await registry.synchronise()
            assert len(registry.sessions) == sessions
        running = [asyncio.create_task(registry.replicas.run()) for registry in registries]
        await asyncio.sleep(2)
        requests, own, nats = sum(bus.requests for bus in buses), time.process_time(), cpu_seconds(server.pid)
        await asyncio.sleep(seconds)
        requests = sum(bus.requests for bus in buses) - requests
        own, nats = time.process_time() - own, cpu_seconds(server.pid) - nats
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)
        for store, bus in zip(stores, buses, strict=True):
            await store.close()
            await bus.close()
        return {
            "register_requests_second": round(requests / seconds, 1),
            "register_ms_replica_second": round(own * 1e3 / seconds / replicas, 2),
            "register_nats_ms_second": round(nats * 1e3 / seconds, 2),
        }

    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, run_jetstream(Path(folder)) as server:
        return asyncio.run(run_heartbeats(server))


def measure_share_links(concurrency: int = 5, lookups: int = 2000) -> Figures:
    """Measure the CPU time of a service for the lookup of a share link in PostgreSQL."""

    async def look_up(url: str) -> Figures:
        catalogue = Catalogue(url)
        await catalogue.open()
        used = time.process_time()
        for _ in range(lookups // concurrency):
            await asyncio.gather(*(catalogue.get_share("nothing") for _ in range(concurrency)))
        used = time.process_time() - used
        await catalogue.close()
        return {"link_us": round(used * 1e6 / lookups)}

    with run_postgres() as server:
        return asyncio.run(look_up(f"postgresql://postgres@127.0.0.1:{server.port}/postgres"))


BENCHMARKS: dict[str, Callable[[], Figures]] = {
    "dance": measure_demo_delivery,
    "gateway": measure_gateway,
    "origin": measure_origin,
    "register": measure_key_value_store,
    "links": measure_share_links,
}


def main() -> None:
    parts = parse_parts(__doc__, BENCHMARKS)
    figures: Figures = {}
    for part in parts:
        found = BENCHMARKS[part]()
        figures |= found
        for name, value in found.items():
            print(f"{name:<32}{value:>10}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
