"""What deploy/SCALE.md counts with, beside what other benches tell: `make bench-scale`. `gateway` needs Caddy.

The last line printed is one JSON object. `dance`: the demo's dance with all its tracks to many viewers of one process.
`gateway`: overlays of one limb through Caddy with our Caddyfile; what it needs of a processor and of memory for each
viewer. `origin`: blocks over HTTP, as a CDN fetches them, by connections that stay open. `register` and `links`: what
is asked of NATS for each session, and of PostgreSQL for who comes by a link.
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

from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.catalogue import Catalogue
from bunraku.backing.register_nats import NatsRegister
from bunraku.client import Client
from tests.bench.fanout_processes import Told
from tests.bench.fanout_senders import SESSION
from tests.bench.parts import asked
from tests.conftest import REPOSITORY
from tests.processes import Owned, free_port, jetstream, postgres, processor_seconds, url_of

Figures = dict[str, float]


@contextmanager
def demo() -> Iterator[tuple[Told, str]]:
    """A whole server in a process of its own, with the demo's dance on the stage; and where it is."""
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        bunraku = str(Path(sys.executable).parent / "bunraku")
        with Told([bunraku, "up", "--demo", "--port", "0", "--data", folder]) as server:
            found = None
            while found is None:
                found = re.search(r"is at (http://\S+)/", server.line())
            # what it loads after its start is not the viewers'
            used = -1.0
            while server.processor_seconds() - used > 0.1:
                used = server.processor_seconds()
                time.sleep(3)
            yield server, found[1]


async def _stage(url: str) -> tuple[str, str]:
    """The demo's session and motion."""
    async with Client(url) as client:
        session = await client.first_session()
        assert session is not None
        return session, (await client.session(session))["motion"]


def dance(viewers: int = 1000, seconds: float = 20.0) -> Figures:
    """Cores and bytes of a dance with sound, camera and lights, for each viewer."""
    with demo() as (server, url):
        session, _ = asyncio.run(_stage(url))
        path, port = f"/v1/sessions/{session}/stream", url.rpartition(":")[2]
        alone, joining = server.processor_seconds(), time.monotonic()
        with Told.module("fanout_drain", port, viewers, "bunraku", path) as drain:
            assert drain.line() == "ready"
            # what is sent ahead at first is the join's
            time.sleep(10)
            drain.ask("")
            before, begun = server.processor_seconds(), time.monotonic()
            time.sleep(seconds)
            passed, cores = time.monotonic() - begun, server.processor_seconds() - before
            came = drain.ask("")
    joined = before - alone - cores / passed * (begun - joining)
    assert came["open"] == viewers
    return {
        "dance_viewers": viewers,
        "dance_messages_viewer_second": round(came["frames"] / passed / viewers, 2),
        "dance_kbps_viewer": round(came["bytes"] * 8e-3 / passed / viewers, 1),
        "dance_join_ms": round(joined * 1e3 / viewers, 2),
        "dance_cores": round(cores / passed, 3),
        "dance_viewers_core": round(viewers * passed / cores),
    }


@contextmanager
def gateway_to(port: str) -> Iterator[tuple[Told, int]]:
    """Caddy with our file, all services at one port of this machine; and its own port."""
    program, own = shutil.which("caddy"), free_port()
    if program is None:
        raise RuntimeError("Caddy is not installed")
    text = (REPOSITORY / "deploy" / "Caddyfile").read_text()
    text = re.sub(r"dynamic a \w+ 8000", f"dynamic a localhost {port}", text).replace(":8079", f":{free_port()}")
    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder:
        file = Path(folder) / "Caddyfile"
        file.write_text(text)
        set_to = [f"BUNRAKU_SITE=:{own}", f"XDG_DATA_HOME={folder}", f"XDG_CONFIG_HOME={folder}"]
        with Told(["env", *set_to, program, "run", "--config", str(file), "--adapter", "caddyfile"]) as caddy:
            while True:
                try:
                    socket.create_connection(("127.0.0.1", own), 1).close()
                    break
                except OSError:
                    time.sleep(0.05)
            yield caddy, own


def gateway(viewers: int = 600, hertz: int = 20, seconds: float = 10.0) -> Figures:
    """Overlays of one limb, 66 bytes, by way of the gateway."""
    path = f"/v1/sessions/{SESSION}/stream"
    with Told.module("fanout_senders", "bunraku", 66, hertz) as sender, gateway_to(sender.line()) as (caddy, own):
        before = caddy.resident_kilobytes()
        with Told.module("fanout_drain", own, viewers, "bunraku", path) as drain:
            assert drain.line() == "ready"
            sender.ask(2)
            drain.ask("")
            used = caddy.processor_seconds()
            sent = sender.ask(seconds)
            cores = caddy.processor_seconds() - used
            memory = caddy.resident_kilobytes() - before
            time.sleep(0.5)
            came = drain.ask("")
    assert came["open"] == viewers
    assert came["frames"] >= 0.95 * sent["messages"] > 0
    return {
        "gateway_us_message": round(cores * 1e6 / sent["messages"], 1),
        "gateway_kb_viewer": round(memory / viewers, 1),
        "stream_us_message": round(sent["cpu"] * 1e6 / sent["messages"], 1),
    }


def origin(connections: int = 8, seconds: float = 8.0) -> Figures:
    """Blocks a second that one process gives over HTTP, and what they need of a processor."""
    with demo() as (server, url):
        _, motion = asyncio.run(_stage(url))
        host, port = url.removeprefix("http://").split(":")
        asked = f"GET /v1/motions/{motion}/blocks/4/1 HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()

        async def fetch(until: float) -> int:
            reader, writer = await asyncio.open_connection(host, int(port))
            number = 0
            while time.monotonic() < until:
                writer.write(asked)
                head = await reader.readuntil(b"\r\n\r\n")
                assert b" 200 " in head[:20]
                assert b"immutable" in head
                length = re.search(rb"content-length: (\d+)", head)
                assert length is not None
                await reader.readexactly(int(length[1]))
                number += 1
            writer.close()
            return number

        async def every() -> int:
            until = time.monotonic() + seconds
            return sum(await asyncio.gather(*(fetch(until) for _ in range(connections))))

        before = server.processor_seconds()
        fetched = asyncio.run(every())
        used = server.processor_seconds() - before
    return {"origin_blocks_second": round(fetched / seconds), "origin_us_block": round(used * 1e6 / fetched)}


def register(sessions: int = 500, rounds: int = 10) -> Figures:
    """What each session costs each session replica, and NATS, at each beat."""

    async def beats(server: Owned) -> Figures:
        bus = NatsBus(url_of(server))
        await bus.open()
        kept = NatsRegister(bus)
        for number in range(sessions):
            await kept.put(f"sessions.{number}", bytes(80))
        own, nats = time.process_time(), processor_seconds(server.pid)
        for _ in range(rounds):
            assert len(await kept.all("sessions")) == sessions
        own, nats = time.process_time() - own, processor_seconds(server.pid) - nats
        await bus.close()
        each = sessions * rounds * 1e-6
        return {"register_us_session": round(own / each), "register_nats_us_session": round(nats / each)}

    with tempfile.TemporaryDirectory(prefix="bunraku-bench-") as folder, jetstream(Path(folder)) as server:
        return asyncio.run(beats(server))


def links(at_once: int = 5, lookups: int = 2000) -> Figures:
    """What it costs a service to look a link up in PostgreSQL."""

    async def look(url: str) -> Figures:
        catalogue = Catalogue(url)
        await catalogue.open()
        used = time.process_time()
        for _ in range(lookups // at_once):
            await asyncio.gather(*(catalogue.share("nothing") for _ in range(at_once)))
        used = time.process_time() - used
        await catalogue.close()
        return {"link_us": round(used * 1e6 / lookups)}

    with postgres() as server:
        return asyncio.run(look(f"postgresql://postgres@127.0.0.1:{server.port}/postgres"))


PARTS: dict[str, Callable[[], Figures]] = {
    "dance": dance,
    "gateway": gateway,
    "origin": origin,
    "register": register,
    "links": links,
}


def main() -> None:
    parts = asked(__doc__, PARTS)
    figures: Figures = {}
    for part in parts:
        found = PARTS[part]()
        figures |= found
        for name, value in found.items():
            print(f"{name:<32}{value:>10}")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
