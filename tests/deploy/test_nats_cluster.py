"""The three NATS servers of deploy/kubernetes/overlays/cluster, with its own file: one may die."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.register_nats import NatsRegister
from bunraku.backing.unavailable import Unavailable
from tests.deploy.manifests import KUBERNETES
from tests.deploy.nats_files import on_this_machine
from tests.processes import Owned, free_port, needed

SERVERS = 3
CONFIG = KUBERNETES / "overlays" / "cluster" / "nats.conf"


@pytest.fixture
def servers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Owned]]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", "0123abcd")
    program = needed("nats-server")
    routes = [free_port() for _ in range(SERVERS)]
    every = ",".join(f"nats://bunraku:0123abcd@127.0.0.1:{port}" for port in routes)
    with ExitStack() as stack:
        made = []
        for number in range(SERVERS):
            folder = tmp_path / f"nats-{number}"
            folder.mkdir()
            there = {"0.0.0.0:6222": f"127.0.0.1:{routes[number]}", "/var/lib/nats": str(folder / "store")}
            file, port = on_this_machine(CONFIG, folder, there), free_port()
            # of a name each, as the cluster's pods have
            command = ["env", f"BUNRAKU_BUS_NAME=nats-{number}", program, f"--config={file}", f"--routes={every}"]
            server = Owned([*command, "-a", "127.0.0.1", "-p", str(port)], port, folder)
            stack.callback(server.stop)
            server.start()
            made.append(server)
        yield made


async def kept(register: NatsRegister, key: str, value: bytes) -> None:
    """Put, once the servers agree on who leads them."""
    async with asyncio.timeout(60):
        while True:
            try:
                await register.put(key, value)
            except Unavailable:
                await asyncio.sleep(0.1)
            else:
                return


async def test_the_register_outlives_any_one_of_three_servers(servers: list[Owned]) -> None:
    bus = NatsBus("nats://" + ",".join(f"bunraku:0123abcd@127.0.0.1:{server.port}" for server in servers))
    await bus.open(20)
    try:
        register = NatsRegister(bus, SERVERS)
        await kept(register, "sessions.a", b"1")
        for number, server in enumerate(servers):
            await asyncio.to_thread(server.kill)
            # whichever it was, the leader or the one that the bus was connected to
            await kept(register, f"sessions.{number}", b"2")
            found = await register.all("sessions")
            assert found["sessions.a"].value == b"1"
            assert len(found) == number + 2
            await asyncio.to_thread(server.start)
            # all three have it again before the next one goes
            await whole(bus)
    finally:
        await bus.close()


async def whole(bus: NatsBus) -> None:
    """Until the register's bucket is up to date at every server."""

    async with asyncio.timeout(60):
        while True:
            try:
                told = json.loads(await bus.ask("$JS.API.STREAM.INFO.KV_bunraku"))
                others = told["cluster"]["replicas"]
                if len(others) == SERVERS - 1 and all(one["current"] for one in others):
                    return
            except (KeyError, Unavailable):
                pass
            await asyncio.sleep(0.1)
