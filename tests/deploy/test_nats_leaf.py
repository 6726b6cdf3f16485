"""A second region: deploy/nats-hub.conf and deploy/nats-leaf.conf in two real nats-servers, with TLS between them.

The session is at the hub, two stream replicas are at the leaf."""

from __future__ import annotations

import asyncio
import json
import statistics
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
from tests.deploy.nats_config import create_certificates, localize_config
from tests.processes import ServerProcess, find_program, free_port
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

PASSWORD = "0123abcd"
REQUIRED_OVERLAYS = 60
"""Overlays that every viewer must receive."""


class RegionDeployment:
    """Two NATS servers, and the addresses of services by name."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.monitoring_port = free_port()
        self.buses: dict[str, ServerProcess] = {}
        self.urls: dict[str, str] = {}

    def bus(self, name: str) -> str:
        return f"tls://bunraku:{PASSWORD}@127.0.0.1:{self.buses[name].port}?ca={self.folder}/tls/ca.crt"

    def leaf_message_count(self) -> int:
        """Return the number of messages that the hub has sent to the leaf."""
        with urlopen(f"http://127.0.0.1:{self.monitoring_port}/leafz") as response:
            (leaf,) = json.load(response)["leafs"]
        return int(leaf["out_msgs"])


@pytest.fixture
def regions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[RegionDeployment]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", PASSWORD)
    deployment, leaf_port, tls = RegionDeployment(tmp_path), free_port(), tmp_path / "tls"
    create_certificates(tls)
    replacements = {
        "hub": {
            "127.0.0.1:8222": f"127.0.0.1:{deployment.monitoring_port}",
            "/var/lib/nats": str(tmp_path / "hub" / "store"),
            "0.0.0.0:7422": f"127.0.0.1:{leaf_port}",
        },
        "leaf": {"hub.example.org:7422": f"127.0.0.1:{leaf_port}"},
    }
    with ExitStack() as stack:

        def start(name: str, command: list[str], port: int) -> ServerProcess:
            server = ServerProcess(command, port, tmp_path / name)
            stack.callback(server.stop)
            server.start()
            return server

        for name, own_replacements in replacements.items():
            (tmp_path / name).mkdir()
            source = REPOSITORY / "deploy" / f"nats-{name}.conf"
            file, port = (
                localize_config(source, tmp_path / name, {**own_replacements, "/run/tls": str(tls)}),
                free_port(),
            )
            command = [find_program("nats-server"), "-c", str(file), "-a", "127.0.0.1", "-p", str(port)]
            deployment.buses[name] = start(name, command, port)
        for name, bus, services in (
            ("home", "hub", ("ingest", "session", "stream")),
            ("far 1", "leaf", ("stream",)),
            ("far 2", "leaf", ("stream",)),
        ):
            server = run_server(tmp_path / "data", bus=deployment.bus(bus), services=services)
            deployment.urls[name] = stack.enter_context(server)
        yield deployment


class OverlayArrivals:
    """Arrival times of overlays at one viewer, seconds, by sequence number."""

    def __init__(self) -> None:
        self.arrived_at: dict[int, float] = {}
        self.enough = asyncio.Event()

    async def read(self, socket: Any) -> None:
        async for data in socket:
            if isinstance(message := unpack(data), Overlay):
                self.arrived_at[message.sequence] = time.monotonic()
                if len(self.arrived_at) >= REQUIRED_OVERLAYS:
                    self.enough.set()


async def control_left_hand(puppeteer: Puppeteer) -> None:
    """Control the left hand; claim it again if it was lost while the servers of this process were loading."""
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
        arrivals = OverlayArrivals()
        reading = asyncio.create_task(arrivals.read(socket))
        try:
            yield arrivals
        finally:
            reading.cancel()
            await asyncio.wait((reading,))


async def test_overlay_reaches_another_region_and_crosses_the_link_once(regions: RegionDeployment) -> None:
    source = regions.folder / "one.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    async with AsyncExitStack() as stack:
        home = await stack.enter_async_context(Client(regions.urls["home"]))
        motion = (await home.upload(source))["id"]
        session = (await home.open_session(motion))["id"]
        # a replica at a leaf is ready like any other
        for name in ("far 1", "far 2"):
            assert (await asyncio.to_thread(urlopen, f"{regions.urls[name]}/readyz")).status == 200
        near, one, other = [
            await stack.enter_async_context(record_arrivals(regions.urls[name], session))
            for name in ("home", "far 1", "far 2")
        ]
        before = regions.leaf_message_count()
        puppeteer = await stack.enter_async_context(Puppeteer(home, session, "Aiko"))
        controlling = asyncio.create_task(control_left_hand(puppeteer))
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await asyncio.gather(*(viewer.enough.wait() for viewer in (near, one, other)))
        controlling.cancel()
        await asyncio.wait((controlling,))
        link_messages = regions.leaf_message_count() - before
        overlays = max(len(one.arrived_at), len(other.arrived_at))
        # once for both replicas; a watched session causes few other messages
        assert REQUIRED_OVERLAYS <= link_messages < 1.5 * overlays
        # the number of viewers at the leaf is known at the hub
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while (await home.session(session))["viewers"] != 3:  # noqa: ASYNC110
                await asyncio.sleep(0.05)


async def test_leaf_adds_little_latency(regions: RegionDeployment, tally: Callable[[str], None]) -> None:
    source, near, far = buses = [NatsBus(regions.bus(name)) for name in ("hub", "hub", "leaf")]
    for bus in buses:
        await bus.open()
    try:
        arrivals: dict[NatsBus, list[float]] = {near: [], far: []}
        changed = asyncio.Event()

        def make_handler(bus: NatsBus) -> Callable[[bytes], None]:
            def handle(_: bytes) -> None:
                arrivals[bus].append(time.monotonic())
                changed.set()

            return handle

        for bus in (near, far):
            bus.subscribe("session.a.overlay", make_handler(bus))
            # once this returns, the subscription is active
            await wait_for_subscription(source, bus)
        for number in range(REQUIRED_OVERLAYS):
            source.publish("session.a.overlay", bytes(66))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while min(map(len, arrivals.values())) <= number:
                    changed.clear()
                    await changed.wait()
    finally:
        for bus in buses:
            await bus.close()
    delays = sorted(b - a for a, b in zip(arrivals[near], arrivals[far], strict=True))
    p50, p95 = statistics.median(delays) * 1e3, delays[int(0.95 * len(delays))] * 1e3
    tally(f"added latency of a message over the leaf: p50 {p50:.2f} ms, p95 {p95:.2f} ms")


async def wait_for_subscription(source: NatsBus, bus: NatsBus) -> None:
    """Wait until a message published at `source` reaches `bus`."""
    own_replacements = asyncio.Event()
    subscription = bus.subscribe("there", lambda _: own_replacements.set())
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not own_replacements.is_set():
            source.publish("there", b"")
            await asyncio.sleep(0.01)
    subscription.unsubscribe()


async def test_key_value_store_works_only_at_the_hub(regions: RegionDeployment) -> None:
    buses = [NatsBus(regions.bus(name)) for name in ("hub", "leaf")]
    for bus in buses:
        await bus.open()
    try:
        hub, leaf = map(NatsKeyValueStore, buses)
        await hub.put("sessions.a", b"1")
        # nats-server forwards no JetStream request over a leaf: a session replica there is not ready and says why
        with pytest.raises(BackendUnavailable, match="JetStream does not answer"):
            await leaf.get("sessions.a")
    finally:
        for bus in buses:
            await bus.close()
