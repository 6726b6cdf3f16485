"""The three NATS servers of deploy/kubernetes/overlays/cluster, with its own file: one may die."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.runtime.availability import BackendUnavailable
from tests.deploy.manifests import KUBERNETES
from tests.deploy.nats_config import localize_config
from tests.processes import ServerProcess, find_program, free_port

SERVERS = 3
CONFIG = KUBERNETES / "overlays" / "cluster" / "nats.conf"


@pytest.fixture
def servers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[ServerProcess]]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", "0123abcd")
    program = find_program("nats-server")
    routes = [free_port() for _ in range(SERVERS)]
    every = ",".join(f"nats://bunraku:0123abcd@127.0.0.1:{port}" for port in routes)
    with ExitStack() as stack:
        made = []
        for number in range(SERVERS):
            folder = tmp_path / f"nats-{number}"
            folder.mkdir()
            there = {"0.0.0.0:6222": f"127.0.0.1:{routes[number]}", "/var/lib/nats": str(folder / "store")}
            file, port = localize_config(CONFIG, folder, there), free_port()
            # of a name each, as the cluster's pods have
            command = ["env", f"BUNRAKU_BUS_NAME=nats-{number}", program, f"--config={file}", f"--routes={every}"]
            server = ServerProcess([*command, "-a", "127.0.0.1", "-p", str(port)], port, folder)
            stack.callback(server.stop)
            server.start()
            made.append(server)
        yield made


async def put_when_available(register: NatsKeyValueStore, key: str, value: bytes) -> None:
    """Put, once the servers agree on who leads them."""
    async with asyncio.timeout(60):
        while True:
            try:
                await register.put(key, value)
            except BackendUnavailable:
                await asyncio.sleep(0.1)
            else:
                return


async def test_the_register_outlives_any_one_of_three_servers(servers: list[ServerProcess]) -> None:
    bus = NatsBus("nats://" + ",".join(f"bunraku:0123abcd@127.0.0.1:{server.port}" for server in servers))
    await bus.open(20)
    try:
        register = NatsKeyValueStore(bus, SERVERS)
        await put_when_available(register, "sessions.a", b"1")
        for number, server in enumerate(servers):
            await asyncio.to_thread(server.kill)
            # whichever it was, the leader or the one that the bus was connected to
            await put_when_available(register, f"sessions.{number}", b"2")
            found = await register.list_prefix("sessions")
            assert found["sessions.a"].value == b"1"
            assert len(found) == number + 2
            await asyncio.to_thread(server.start)
            # all three have it again before the next one goes
            await wait_for_replication(bus)
    finally:
        await bus.close()


async def wait_for_replication(bus: NatsBus) -> None:
    """Until the register's bucket is up to date at every server."""

    async with asyncio.timeout(60):
        while True:
            try:
                told = json.loads(await bus.request("$JS.API.STREAM.INFO.KV_bunraku"))
                others = told["cluster"]["replicas"]
                if len(others) == SERVERS - 1 and all(one["current"] for one in others):
                    return
            except (KeyError, BackendUnavailable):
                pass
            await asyncio.sleep(0.1)
