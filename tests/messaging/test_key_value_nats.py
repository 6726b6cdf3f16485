"""Key-value store during outages of a real nats-server."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from bunraku.messaging import key_value_nats, key_value_watch_nats
from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value_nats import NatsKeyValueStore
from bunraku.messaging.nats_connection import NatsMessage
from bunraku.runtime.availability import BackendUnavailable
from tests.processes import ServerProcess, free_port, nats_url_of, run_jetstream, run_nats_server
from tests.time_limit import HANG_TIMEOUT_S


@asynccontextmanager
async def open_store(url: str) -> AsyncIterator[tuple[NatsBus, NatsKeyValueStore]]:
    bus = NatsBus(url)
    await bus.open()
    try:
        yield bus, NatsKeyValueStore(bus)
    finally:
        await bus.close()


@asynccontextmanager
async def open_bucket(server: ServerProcess) -> AsyncIterator[tuple[NatsBus, NatsKeyValueStore]]:
    """Open the store of a server that has created the bucket, which a busy machine may not do in time at first."""
    async with open_store(nats_url_of(server)) as (bus, store):
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while True:
                with suppress(BackendUnavailable):
                    await store.get("sessions.none")
                    break
        yield bus, store


async def wait_until_connected(bus: NatsBus, server: ServerProcess) -> None:
    reconnected = asyncio.Event()
    subscription = bus.on_reconnect(reconnected.set)
    await asyncio.to_thread(server.start)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        await reconnected.wait()
    subscription.unsubscribe()


async def test_value_survives_a_server_crash(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            revision = await store.put("sessions.a", b"1", 0)
            server.kill()
            for operation in (
                store.get("sessions.a"),
                store.synchronise(),
                store.put("sessions.a", b"2"),
            ):
                with pytest.raises(BackendUnavailable):
                    await operation
            await wait_until_connected(bus, server)
            assert await store.put("sessions.a", b"2", revision) > revision


async def test_bucket_is_recreated_after_data_loss(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            await store.put("sessions.a", b"1")
            server.stop()
            shutil.rmtree(tmp_path / "store")
            await wait_until_connected(bus, server)
            assert await store.get("sessions.a") is None
            # the first write may find no stream
            try:
                await store.put("sessions.a", b"2", 0)
            except BackendUnavailable:
                await store.put("sessions.a", b"2", 0)
            assert await synchronised_keys(store) == {"sessions.a": b"2"}


async def test_suspended_server_is_unavailable_until_resumed(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            await store.put("sessions.a", b"1")
            reconnected = asyncio.Event()
            bus.on_reconnect(reconnected.set)
            server.pause()
            try:
                async with asyncio.timeout(HANG_TIMEOUT_S):
                    with pytest.raises(BackendUnavailable):
                        await store.get("sessions.a")
            finally:
                server.resume()
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while not bus.is_connected:
                    reconnected.clear()
                    await reconnected.wait()
            found = await store.get("sessions.a")
            assert found is not None
            assert found.value == b"1"


async def test_server_without_jetstream_is_unavailable(tmp_path: Path) -> None:
    with run_nats_server(tmp_path) as server:
        async with open_store(nats_url_of(server)) as (_, store):
            with pytest.raises(BackendUnavailable, match="JetStream"):
                await store.get("a.b")


async def test_unreachable_server_is_unavailable() -> None:
    async with open_store(f"nats://127.0.0.1:{free_port()}") as (_, store):
        with pytest.raises(BackendUnavailable):
            await store.get("a.b")


async def synchronised_keys(store: NatsKeyValueStore) -> dict[str, bytes]:
    """Return the values of a store's local copy once it contains everything."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                await store.synchronise()
                return {key: entry.value for key, entry in store.watch().entries.items()}
            except BackendUnavailable:
                await asyncio.sleep(0.02)


async def synchronise_again_and_again(store: NatsKeyValueStore) -> None:
    while True:
        await store.synchronise()


async def test_watch_misses_no_change_when_its_connection_is_cut(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store), open_bucket(server) as (_, other):
            changes: list[tuple[str, bytes | None]] = []
            store.watch().on_change(lambda key, entry: changes.append((key, None if entry is None else entry.value)))
            await other.put("sessions.ended", b"0")
            await synchronised_keys(store)
            for number in range(5):
                assert bus._connection is not None
                bus._connection.abort("cut by the test")
                # while nobody receives
                await other.put("sessions.a", b"%d" % number)
                await other.put(f"sessions.{number}", b"new")
                await other.remove("sessions.ended")
                expected = {f"sessions.{written}": b"new" for written in range(number + 1)}
                assert await synchronised_keys(store) == {**expected, "sessions.a": b"%d" % number}
            assert ("sessions.ended", None) in changes
            assert changes[-1] in [("sessions.4", b"new"), ("sessions.a", b"4")]
            await store.close()


async def test_watch_follows_a_server_that_lost_its_data(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            for number in range(20):
                await store.put("sessions.a", b"%d" % number)
            assert await synchronised_keys(store) == {"sessions.a": b"19"}
            server.stop()
            shutil.rmtree(tmp_path / "store")
            await wait_until_connected(bus, server)
            assert await synchronised_keys(store) == {}
            revision = await store.put("sessions.b", b"1", 0)
            assert await synchronised_keys(store) == {"sessions.b": b"1"}
            assert store.watch().revision == revision < 20
            await store.close()


async def test_watch_begins_again_after_a_missing_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            await store.put("sessions.a", b"1")
            await synchronised_keys(store)
            deliver, dropped = bus.on_message, asyncio.Event()

            def drop_one(message: NatsMessage) -> None:
                if message.subject.endswith("sessions.b") and not dropped.is_set():
                    dropped.set()
                else:
                    deliver(message)

            monkeypatch.setattr(bus, "on_message", drop_one)
            await store.put("sessions.b", b"2")
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await dropped.wait()
                # found by the next sign of life, or by the next change
                await store.watch().wait_for(await store.put("sessions.c", b"3"), 20)
            assert await synchronised_keys(store) == {"sessions.a": b"1", "sessions.b": b"2", "sessions.c": b"3"}
            await store.close()


async def test_removed_keys_leave_nothing_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(key_value_nats, "MARKER_LIFETIME_S", 0.0)
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (bus, store):
            for number in range(30):
                await store.put(f"sessions.{number}", b"1", 0)
                await store.remove(f"sessions.{number}")
                # a key that exists again is not purged
                await store.put("sessions.again", b"%d" % number, 0)
                if number < 29:
                    await store.remove("sessions.again")
            info = json.loads(await bus.request("$JS.API.STREAM.INFO.KV_bunraku"))
            assert info["state"]["messages"] <= 3
            assert await synchronised_keys(store) == {"sessions.again": b"29"}


async def test_copy_counts_as_incomplete_while_no_consumer_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the server's signs of life come later than this, so that each consumer is given up
    monkeypatch.setattr(key_value_watch_nats, "MAX_MISSED_HEARTBEATS", 0.05)
    monkeypatch.setattr(key_value_watch_nats, "RESTART_DELAY_S", 10 * HANG_TIMEOUT_S)
    with run_jetstream(tmp_path) as server:
        async with open_bucket(server) as (_, store):
            await store.put("sessions.a", b"1")
            await synchronised_keys(store)
            async with asyncio.timeout(HANG_TIMEOUT_S):
                with pytest.raises(BackendUnavailable, match="register"):
                    await synchronise_again_and_again(store)
