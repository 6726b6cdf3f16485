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

from bunraku.client import Client, ControlRefused, Puppeteer
from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.runtime.availability import BackendUnavailable
from bunraku.wire.messages import SUBPROTOCOL, unpack
from bunraku.wire.overlay import Overlay
from tests.conftest import REPOSITORY
from tests.deploy.nats_config import localize_config
from tests.processes import ServerProcess, find_program, free_port
from tests.servers import make_bvh_clip, run_server

PASSWORD = "0123abcd"
TIMEOUT_S = 60
REQUIRED_OVERLAYS = 60
"""Overlays that every viewer is to get."""


def create_certificates(folder: Path) -> None:
    """An authority of our own, and what it says of the one certificate that hub and leaf both show."""
    program = find_program("openssl")
    steps = (
        "req -x509 -newkey ed25519 -nodes -days 2 -subj /CN=ours -keyout ca.key -out ca.crt",
        "req -newkey ed25519 -nodes -subj /CN=bus -addext subjectAltName=IP:127.0.0.1 -keyout tls.key -out tls.csr",
        "x509 -req -in tls.csr -days 2 -CA ca.crt -CAkey ca.key -CAcreateserial -copy_extensions copy -out tls.crt",
    )
    for step in steps:
        subprocess.run([program, *step.split()], cwd=folder, check=True, capture_output=True)


class RegionDeployment:
    """The two buses, and the addresses of services by name."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.monitoring_port = free_port()
        self.buses: dict[str, ServerProcess] = {}
        self.urls: dict[str, str] = {}

    def bus(self, name: str) -> str:
        return f"nats://bunraku:{PASSWORD}@127.0.0.1:{self.buses[name].port}"

    def leaf_message_count(self) -> int:
        """Messages that the hub has sent the leaf."""
        with urlopen(f"http://127.0.0.1:{self.monitoring_port}/leafz") as answer:
            (leaf,) = json.load(answer)["leafs"]
        return int(leaf["out_msgs"])


@pytest.fixture
def regions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[RegionDeployment]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", PASSWORD)
    built, door, tls = RegionDeployment(tmp_path), free_port(), tmp_path / "tls"
    tls.mkdir()
    create_certificates(tls)
    places = {
        "hub": {
            "127.0.0.1:8222": f"127.0.0.1:{built.monitoring_port}",
            "/var/lib/nats": str(tmp_path / "hub" / "store"),
            "0.0.0.0:7422": f"127.0.0.1:{door}",
        },
        "leaf": {"hub.example.org:7422": f"127.0.0.1:{door}"},
    }
    with ExitStack() as stack:

        def start(name: str, command: list[str], port: int) -> ServerProcess:
            server = ServerProcess(command, port, tmp_path / name)
            stack.callback(server.stop)
            server.start()
            return server

        for name, there in places.items():
            (tmp_path / name).mkdir()
            source = REPOSITORY / "deploy" / f"nats-{name}.conf"
            file, port = localize_config(source, tmp_path / name, {**there, "/etc/bunraku/tls": str(tls)}), free_port()
            command = [find_program("nats-server"), "-c", str(file), "-a", "127.0.0.1", "-p", str(port)]
            built.buses[name] = start(name, command, port)
        for name, bus, services in (
            ("home", "hub", ("ingest", "session", "stream")),
            ("far 1", "leaf", ("stream",)),
            ("far 2", "leaf", ("stream",)),
        ):
            server = run_server(tmp_path / "data", bus=built.bus(bus), services=services)
            built.urls[name] = stack.enter_context(server)
        yield built


class OverlayArrivals:
    """When overlays came to one viewer, seconds, by their number."""

    def __init__(self) -> None:
        self.at: dict[int, float] = {}
        self.enough = asyncio.Event()

    async def read(self, socket: Any) -> None:
        async for data in socket:
            if isinstance(message := unpack(data), Overlay):
                self.at[message.sequence] = time.monotonic()
                if len(self.at) >= REQUIRED_OVERLAYS:
                    self.enough.set()


async def control_left_hand(puppeteer: Puppeteer) -> None:
    """Hold the left hand, also where it was lost while the servers, which are of this process, loaded something."""
    while True:
        try:
            await puppeteer.target("left_hand", 0.4, 0.1, 0.4)
        except ControlRefused:
            with suppress(ControlRefused):
                await puppeteer.claim("left_hand")
        await asyncio.sleep(0.05)


@asynccontextmanager
async def record_arrivals(url: str, session: str) -> AsyncIterator[OverlayArrivals]:
    address = url.replace("http", "ws") + f"/v1/sessions/{session}/stream?rate=0"
    async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]
        came = OverlayArrivals()
        reading = asyncio.create_task(came.read(socket))
        try:
            yield came
        finally:
            reading.cancel()
            await asyncio.wait((reading,))


async def test_a_pull_is_seen_in_another_region_and_crosses_once(regions: RegionDeployment) -> None:
    source = regions.folder / "one.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    async with AsyncExitStack() as stack:
        home = await stack.enter_async_context(Client(regions.urls["home"]))
        motion = (await home.upload(source))["id"]
        session = (await home.open_session(motion))["id"]
        # a replica whose bus is a leaf is ready as any other
        for name in ("far 1", "far 2"):
            assert (await asyncio.to_thread(urlopen, f"{regions.urls[name]}/readyz")).status == 200
        near, one, other = [
            await stack.enter_async_context(record_arrivals(regions.urls[name], session))
            for name in ("home", "far 1", "far 2")
        ]
        before = regions.leaf_message_count()
        puppeteer = await stack.enter_async_context(Puppeteer(home, session, "Aiko"))
        pulling = asyncio.create_task(control_left_hand(puppeteer))
        async with asyncio.timeout(TIMEOUT_S):
            await asyncio.gather(*(viewer.enough.wait() for viewer in (near, one, other)))
        pulling.cancel()
        await asyncio.wait((pulling,))
        crossed = regions.leaf_message_count() - before
        seen = max(len(one.at), len(other.at))
        # once for both replicas; little else is said of a session that is watched
        assert REQUIRED_OVERLAYS <= crossed < 1.5 * seen
        # and how many watch there is known at home
        async with asyncio.timeout(TIMEOUT_S):
            while (await home.session(session))["viewers"] != 3:  # noqa: ASYNC110
                await asyncio.sleep(0.05)


async def test_the_hub_is_a_moment_away(regions: RegionDeployment, tally: Callable[[str], None]) -> None:
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
            await wait_for_subscription(source, bus)
        for number in range(REQUIRED_OVERLAYS):
            source.publish("session.a.overlay", bytes(66))
            async with asyncio.timeout(TIMEOUT_S):
                while min(map(len, came.values())) <= number:
                    more.clear()
                    await more.wait()
    finally:
        for bus in buses:
            await bus.close()
    later = sorted(b - a for a, b in zip(came[near], came[far], strict=True))
    middle, most = statistics.median(later) * 1e3, later[int(0.95 * len(later))] * 1e3
    tally(f"a message came over the leaf {middle:.2f} ms later at the median, {most:.2f} ms in 95 of 100 times")


async def wait_for_subscription(source: NatsBus, bus: NatsBus) -> None:
    """Until what is published at one bus comes to another."""
    there = asyncio.Event()
    listening = bus.subscribe("there", lambda _: there.set())
    async with asyncio.timeout(TIMEOUT_S):
        while not there.is_set():
            source.publish("there", b"")
            await asyncio.sleep(0.01)
    listening.unsubscribe()


async def test_sessions_are_kept_at_the_hub(regions: RegionDeployment) -> None:
    buses = [NatsBus(regions.bus(name)) for name in ("hub", "leaf")]
    for bus in buses:
        await bus.open()
    try:
        hub, leaf = map(NatsKeyValueStore, buses)
        await hub.put("sessions.a", b"1")
        # nats-server lets nothing of JetStream over a leaf: a session replica there is not ready, and says why
        with pytest.raises(BackendUnavailable, match="JetStream does not answer"):
            await leaf.get("sessions.a")
    finally:
        for bus in buses:
            await bus.close()
