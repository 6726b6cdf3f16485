"""Three NATS servers with the configuration of deploy/kubernetes/overlays/cluster: one may fail."""

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
from tests.deploy.nats_config import create_certificates, localize_config
from tests.processes import ServerProcess, find_program, free_port
from tests.time_limit import HANG_TIMEOUT_S

SERVERS = 3
CONFIG = KUBERNETES / "overlays" / "cluster" / "nats.conf"


@pytest.fixture
def servers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[ServerProcess]]:
    monkeypatch.setenv("BUNRAKU_BUS_PASSWORD", "0123abcd")
    program = find_program("nats-server")
    routes = [free_port() for _ in range(SERVERS)]
    routes_url = ",".join(f"nats://bunraku:0123abcd@127.0.0.1:{port}" for port in routes)
    create_certificates(tmp_path / "tls")
    with ExitStack() as stack:
        started = []
        for number in range(SERVERS):
            folder = tmp_path / f"nats-{number}"
            folder.mkdir()
            replacements = {
                "0.0.0.0:6222": f"127.0.0.1:{routes[number]}",
                "/var/lib/nats": str(folder / "store"),
                "/run/tls": str(tmp_path / "tls"),
            }
            file, port = localize_config(CONFIG, folder, replacements), free_port()
            # each has a name, as the pods of the cluster have
            command = ["env", f"BUNRAKU_BUS_NAME=nats-{number}", program, f"--config={file}", f"--routes={routes_url}"]
            server = ServerProcess([*command, "-a", "127.0.0.1", "-p", str(port)], port, folder)
            stack.callback(server.stop)
            server.start()
            started.append(server)
        yield started


async def put_when_available(key_values: NatsKeyValueStore, key: str, value: bytes) -> None:
    """Put a value; retry until the servers have elected a leader."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                await key_values.put(key, value)
            except BackendUnavailable:
                await asyncio.sleep(0.1)
            else:
                return


async def synchronise_when_available(key_values: NatsKeyValueStore) -> None:
    """Wait until the local copy is current; retry until the servers have elected a leader."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                await key_values.synchronise()
            except BackendUnavailable:
                await asyncio.sleep(0.1)
            else:
                return


async def test_key_value_store_survives_the_loss_of_any_one_server(
    servers: list[ServerProcess], tmp_path: Path
) -> None:
    addresses = ",".join(f"bunraku:0123abcd@127.0.0.1:{server.port}" for server in servers)
    bus = NatsBus(f"tls://{addresses}?ca={tmp_path}/tls/ca.crt")
    await bus.open(20)
    key_values = NatsKeyValueStore(bus, SERVERS)
    try:
        await put_when_available(key_values, "sessions.a", b"1")
        for number, server in enumerate(servers):
            await asyncio.to_thread(server.kill)
            # the killed server may be the leader or the one to which the bus was connected
            await put_when_available(key_values, f"sessions.{number}", b"2")
            # the watch's consumer was at the killed server, or its connection was
            await synchronise_when_available(key_values)
            found = key_values.watch().entries
            assert found["sessions.a"] == await key_values.get("sessions.a")
            assert found["sessions.a"].value == b"1"
            assert len(found) == number + 2
            await asyncio.to_thread(server.start)
            # all three are up to date before the next one is killed
            await wait_for_replication(bus)
    finally:
        await key_values.close()
        await bus.close()


async def wait_for_replication(bus: NatsBus) -> None:
    """Wait until the bucket is up to date at every server."""

    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                info = json.loads(await bus.request("$JS.API.STREAM.INFO.KV_bunraku"))
                replicas = info["cluster"]["replicas"]
                if len(replicas) == SERVERS - 1 and all(one["current"] for one in replicas):
                    return
            except (KeyError, BackendUnavailable):
                pass
            await asyncio.sleep(0.1)
