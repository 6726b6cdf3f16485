"""A register whose server goes away and comes back: a real nats-server, killed, stopped and started again."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.runtime.availability import BackendUnavailable
from tests.processes import ServerProcess, free_port, nats_url_of, run_jetstream, run_nats_server


@asynccontextmanager
async def open_store(url: str) -> AsyncIterator[tuple[NatsBus, NatsKeyValueStore]]:
    bus = NatsBus(url)
    await bus.open()
    try:
        yield bus, NatsKeyValueStore(bus)
    finally:
        await bus.close()


async def wait_until_connected(bus: NatsBus, server: ServerProcess) -> None:
    returned = asyncio.Event()
    subscription = bus.on_reconnect(returned.set)
    await asyncio.to_thread(server.start)
    async with asyncio.timeout(20):
        await returned.wait()
    subscription.unsubscribe()


async def test_what_was_put_is_there_when_the_server_is_back(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_store(nats_url_of(server)) as (bus, register):
            revision = await register.put("sessions.a", b"1", 0)
            server.kill()
            for failing in (
                register.get("sessions.a"),
                register.list_prefix("sessions"),
                register.put("sessions.a", b"2"),
            ):
                with pytest.raises(BackendUnavailable):
                    await failing
            await wait_until_connected(bus, server)
            assert await register.put("sessions.a", b"2", revision) > revision


async def test_a_server_that_lost_everything_gets_a_bucket_again(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_store(nats_url_of(server)) as (bus, register):
            await register.put("sessions.a", b"1")
            server.stop()
            shutil.rmtree(tmp_path / "store")
            await wait_until_connected(bus, server)
            assert await register.list_prefix("sessions") == {}
            assert await register.get("sessions.a") is None
            # the first that is put may find nobody who keeps it, and says so
            try:
                await register.put("sessions.a", b"2", 0)
            except BackendUnavailable:
                await register.put("sessions.a", b"2", 0)
            assert list(await register.list_prefix("sessions")) == ["sessions.a"]


async def test_a_server_that_stands_still_is_given_up(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_store(nats_url_of(server)) as (bus, register):
            await register.put("sessions.a", b"1")
            returned = asyncio.Event()
            bus.on_reconnect(returned.set)
            server.pause()
            try:
                async with asyncio.timeout(20):
                    with pytest.raises(BackendUnavailable):
                        await register.get("sessions.a")
            finally:
                server.resume()
            async with asyncio.timeout(20):
                while not bus.is_connected:
                    returned.clear()
                    await returned.wait()
            found = await register.get("sessions.a")
            assert found is not None
            assert found.value == b"1"


async def test_a_server_without_jetstream_is_no_register(tmp_path: Path) -> None:
    with run_nats_server(tmp_path) as server:
        async with open_store(nats_url_of(server)) as (_, register):
            with pytest.raises(BackendUnavailable, match="JetStream"):
                await register.get("a.b")


async def test_where_nobody_ever_was_it_is_said() -> None:
    async with open_store(f"nats://127.0.0.1:{free_port()}") as (_, register):
        with pytest.raises(BackendUnavailable):
            await register.get("a.b")
