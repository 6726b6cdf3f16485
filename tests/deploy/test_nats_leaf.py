"""A region of its own: deploy/nats-hub.conf and deploy/nats-leaf.conf in two real nats-servers, with TLS between them.
The session is at the hub, two stream replicas are at the leaf."""

from __future__ import annotations

import asyncio
import json
import statistics
import subprocess
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from websockets.asyncio.client import connect

from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.register_nats import NatsRegister
from bunraku.backing.unavailable import Unavailable
from bunraku.client import Client, Puppeteer, Refused
from bunraku.wire.messages import SUBPROTOCOL, unpack
from bunraku.wire.overlay import Overlay
from tests.conftest import REPOSITORY
from tests.deploy.nats_files import on_this_machine
from tests.processes import Owned, free_port, needed
from tests.servers import clip, running

PASSWORD = "0123abcd"
PATIENCE = 60
ENOUGH = 60
"""Overlays that every viewer is to get."""


def certificates(folder: Path) -> None:
    """An authority of our own, and what it says of the one certificate that hub and leaf both show."""
    program = needed("openssl")
    steps = (
        "req -x509 -newkey ed25519 -nodes -days 2 -subj /CN=ours -keyout ca.key -out ca.crt",
        "req -newkey ed25519 -nodes -subj /CN=bus -addext subjectAltName=IP:127.0.0.1 -keyout tls.key -out tls.csr",
        "x509 -req -in tls.csr -days 2 -CA ca.crt -CAkey ca.key -CAcreateserial -copy_extensions copy -out tls.crt",
    )
    for step in steps:
        subprocess.run([program, *step.split()], cwd=folder, check=True, capture_output=True)


class Regions:
    """The two buses, and the addresses of services by name."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.watched = free_port()
        self.buses: dict[str, Owned] = {}
        self.urls: dict[str, str] = {}

    def bus(self, name: str) -> str:
        return f"nats://bunraku:{PASSWORD}@127.0.0.1:{self.buses[name].port}"

    def leaf_heard(self) -> int:
        """Messages that the hub has sent the leaf."""
        with urlopen(f"http://127.0.0.1:{self.watched}/leafz") as answer:
            (leaf,) = json.load(answer)["leafs"]
        return int(leaf["out_msgs"])


@pytest.fixture
def regions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Regions]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", PASSWORD)
    built, door, tls = Regions(tmp_path), free_port(), tmp_path / "tls"
    tls.mkdir()
    certificates(tls)
    places = {
        "hub": {
            "127.0.0.1:8222": f"127.0.0.1:{built.watched}",
            "/var/lib/nats": str(tmp_path / "hub" / "store"),
            "0.0.0.0:7422": f"127.0.0.1:{door}",
        },
        "leaf": {"hub.example.org:7422": f"127.0.0.1:{door}"},
    }
    with ExitStack() as stack:

        def start(name: str, command: list[str], port: int) -> Owned:
            server = Owned(command, port, tmp_path / name)
            stack.callback(server.stop)
            server.start()
            return server

        for name, there in places.items():
            (tmp_path / name).mkdir()
            source = REPOSITORY / "deploy" / f"nats-{name}.conf"
            file, port = on_this_machine(source, tmp_path / name, {**there, "/etc/bunraku/tls": str(tls)}), free_port()
            command = [needed("nats-server"), "-c", str(file), "-a", "127.0.0.1", "-p", str(port)]
            built.buses[name] = start(name, command, port)
        for name, bus, services in (
            ("home", "hub", ("ingest", "session", "stream")),
            ("far 1", "leaf", ("stream",)),
            ("far 2", "leaf", ("stream",)),
        ):
            server = running(tmp_path / "data", bus=built.bus(bus), services=services)
            built.urls[name] = stack.enter_context(server)
        yield built


class Arrivals:
    """When overlays came to one viewer, seconds, by their number."""

    def __init__(self) -> None:
        self.at: dict[int, float] = {}
        self.enough = asyncio.Event()

    async def read(self, socket: Any) -> None:
        async for data in socket:
            if isinstance(message := unpack(data), Overlay):
                self.at[message.sequence] = time.monotonic()
                if len(self.at) >= ENOUGH:
                    self.enough.set()


async def pull(puppeteer: Puppeteer) -> None:
    """Hold the left hand, also where it was lost while the servers, which are of this process, loaded something."""
    while True:
        try:
            await puppeteer.target("left_hand", 0.4, 0.1, 0.4)
        except Refused:
            with suppress(Refused):
                await puppeteer.claim("left_hand")
        await asyncio.sleep(0.05)


@asynccontextmanager
async def arrivals(url: str, session: str) -> AsyncIterator[Arrivals]:
    address = url.replace("http", "ws") + f"/v1/sessions/{session}/stream?rate=0"
    async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
        came = Arrivals()
        reading = asyncio.create_task(came.read(socket))
        try:
            yield came
        finally:
            reading.cancel()
            await asyncio.wait((reading,))


async def test_a_pull_is_seen_in_another_region_and_crosses_once(regions: Regions) -> None:
    source = regions.folder / "one.bvh"
    source.write_bytes(clip(4.0, 1))
    async with AsyncExitStack() as stack:
        home = await stack.enter_async_context(Client(regions.urls["home"]))
        motion = (await home.upload(source))["id"]
        session = (await home.open_session(motion))["id"]
        # a replica whose bus is a leaf is ready as any other
        for name in ("far 1", "far 2"):
            assert (await asyncio.to_thread(urlopen, f"{regions.urls[name]}/readyz")).status == 200
        near, one, other = [
            await stack.enter_async_context(arrivals(regions.urls[name], session))
            for name in ("home", "far 1", "far 2")
        ]
        before = regions.leaf_heard()
        puppeteer = await stack.enter_async_context(Puppeteer(home, session, "Aiko"))
        pulling = asyncio.create_task(pull(puppeteer))
        async with asyncio.timeout(PATIENCE):
            await asyncio.gather(*(viewer.enough.wait() for viewer in (near, one, other)))
        pulling.cancel()
        await asyncio.wait((pulling,))
        crossed = regions.leaf_heard() - before
        seen = max(len(one.at), len(other.at))
        # once for both replicas; little else is said of a session that is watched
        assert ENOUGH <= crossed < 1.5 * seen
        # and how many watch there is known at home
        async with asyncio.timeout(PATIENCE):
            while (await home.session(session))["viewers"] != 3:  # noqa: ASYNC110
                await asyncio.sleep(0.05)


async def test_the_hub_is_a_moment_away(regions: Regions, tally: Callable[[str], None]) -> None:
    source, near, far = buses = [NatsBus(regions.bus(name)) for name in ("hub", "hub", "leaf")]
    for bus in buses:
        await bus.open()
    try:
        came: dict[NatsBus, list[float]] = {near: [], far: []}
        more = asyncio.Event()

        def heard(bus: NatsBus) -> Callable[[bytes], None]:
            def take(_: bytes) -> None:
                came[bus].append(time.monotonic())
                more.set()

            return take

        for bus in (near, far):
            bus.subscribe("session.a.overlay", heard(bus))
            # it is listened to once this is answered
            await until_heard(source, bus)
        for number in range(ENOUGH):
            source.publish("session.a.overlay", bytes(66))
            async with asyncio.timeout(PATIENCE):
                while min(map(len, came.values())) <= number:
                    more.clear()
                    await more.wait()
    finally:
        for bus in buses:
            await bus.close()
    later = sorted(b - a for a, b in zip(came[near], came[far], strict=True))
    middle, most = statistics.median(later) * 1e3, later[int(0.95 * len(later))] * 1e3
    tally(f"a message came over the leaf {middle:.2f} ms later at the median, {most:.2f} ms in 95 of 100 times")


async def until_heard(source: NatsBus, bus: NatsBus) -> None:
    """Until what is published at one bus comes to another."""
    there = asyncio.Event()
    listening = bus.subscribe("there", lambda _: there.set())
    async with asyncio.timeout(PATIENCE):
        while not there.is_set():
            source.publish("there", b"")
            await asyncio.sleep(0.01)
    listening.end()


async def test_sessions_are_kept_at_the_hub(regions: Regions) -> None:
    buses = [NatsBus(regions.bus(name)) for name in ("hub", "leaf")]
    for bus in buses:
        await bus.open()
    try:
        hub, leaf = map(NatsRegister, buses)
        await hub.put("sessions.a", b"1")
        # nats-server lets nothing of JetStream over a leaf: a session replica there is not ready, and says why
        with pytest.raises(Unavailable, match="JetStream does not answer"):
            await leaf.get("sessions.a")
    finally:
        for bus in buses:
            await bus.close()
