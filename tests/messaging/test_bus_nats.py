"""NATS bus with a server that crashes, is suspended, rejects logins or cannot keep up."""

from __future__ import annotations

import asyncio
import tracemalloc
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
import uvloop

from bunraku.messaging import nats_connection
from bunraku.messaging.bus import NoResponse
from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.nats_address import NatsServer, parse_servers
from bunraku.runtime.availability import BackendUnavailable
from tests.messaging.message_recorder import MessageRecorder, flush_buses
from tests.processes import ServerProcess, nats_url_of, run_nats_server
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ServerProcess]:
    with run_nats_server(tmp_path) as process:
        yield process


@asynccontextmanager
async def connect_buses(*urls: str, connect_timeout_s: float = 20) -> AsyncIterator[list[NatsBus]]:
    buses = [NatsBus(url) for url in urls]
    try:
        for bus in buses:
            await bus.open(connect_timeout_s)
        yield buses
    finally:
        for bus in buses:
            await bus.close()


async def wait_until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def echo(data: bytes) -> bytes:
    return data


async def test_subscriptions_are_restored_after_a_server_crash(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        recorder, reconnected = MessageRecorder(), asyncio.Event()
        one.subscribe("a", recorder)
        one.serve("echo", echo)
        one.on_reconnect(reconnected.set)
        await flush_buses(one, two)
        two.publish("a", b"before")
        await recorder.wait_for(b"before")
        pending = asyncio.create_task(two.request("no.responder", b"", 3600))
        server.kill()
        await wait_until(lambda: not one.is_connected and not two.is_connected)
        with pytest.raises((BackendUnavailable, NoResponse)):
            await pending
        with pytest.raises(BackendUnavailable, match="bus"):
            await two.request("echo", b"1")
        for _ in range(1000):
            two.publish("a", b"lost")
        late_recorder = MessageRecorder()
        one.subscribe("b", late_recorder)
        subscription = one.subscribe("c", recorder)
        subscription.unsubscribe()
        assert not reconnected.is_set()
        server.start()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await reconnected.wait()
        await wait_until(lambda: two.is_connected)
        assert await two.request("echo", b"2") == b"2"
        for subject in ("c", "a", "b"):
            two.publish(subject, b"after")
        assert await recorder.wait_for(b"after") == [b"before", b"after"]
        assert await late_recorder.wait_for(b"after") == [b"after"]


async def test_restart_loses_messages_but_duplicates_none(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        recorder = MessageRecorder()
        one.subscribe("a", recorder)
        await flush_buses(one)

        async def stream() -> None:
            number = 0
            while True:
                two.publish("a", b"%06d" % number)
                number += 1
                await asyncio.sleep(0)

        streaming = asyncio.create_task(stream())
        await wait_until(lambda: len(recorder.messages) > 100)
        server.kill()
        server.start()
        await wait_until(lambda: one.is_connected and two.is_connected)
        before = len(recorder.messages)
        await wait_until(lambda: len(recorder.messages) > before + 100)
        streaming.cancel()
        assert recorder.messages == sorted(set(recorder.messages))


@pytest.mark.parametrize("max_missed", [nats_connection.MAX_MISSED_HEARTBEATS, 1_000])
async def test_suspended_server_is_unavailable_until_resumed(
    server: ServerProcess, max_missed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # detected by missed heartbeats, or by a request during which nothing arrived
    monkeypatch.setattr(nats_connection, "MAX_MISSED_HEARTBEATS", max_missed)
    async with connect_buses(nats_url_of(server)) as (bus,):
        bus.serve("echo", echo)
        await flush_buses(bus)
        server.pause()
        with pytest.raises(BackendUnavailable):
            await bus.request("echo", b"1")
        assert not bus.is_connected
        server.resume()
        await wait_until(lambda: bus.is_connected)
        assert await bus.request("echo", b"2") == b"2"


async def test_messages_beyond_the_send_buffer_are_dropped(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        server.pause()
        connection = bus._connection
        assert connection is not None
        tracemalloc.start()
        try:
            while bus.is_connected:
                for number in range(1000):
                    bus.publish("a", b"%d" % number + bytes(10_000))
                assert connection.unsent_bytes <= nats_connection.MAX_UNSENT_BYTES + 20_000
                await asyncio.sleep(0)
            _, peak_bytes = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert peak_bytes < 3 * nats_connection.MAX_UNSENT_BYTES
        # the bus closes while the server is suspended


async def test_messages_of_one_iteration_are_sent_together(
    server: ServerProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    writes: list[bytes] = []
    write = asyncio.selector_events._SelectorSocketTransport.write  # type: ignore[attr-defined]

    def record(transport: asyncio.Transport, data: bytes) -> None:
        writes.append(data)
        write(transport, data)

    async with connect_buses(nats_url_of(server)) as (bus,):
        recorder = MessageRecorder()
        bus.subscribe("a", recorder)
        await flush_buses(bus)
        monkeypatch.setattr(asyncio.selector_events._SelectorSocketTransport, "write", record)  # type: ignore[attr-defined]
        messages = [b"%03d" % number for number in range(100)]
        for message in messages:
            bus.publish("a", message)
        assert not any(b"PUB" in data for data in writes)
        assert await recorder.wait_for(messages[-1]) == messages
        assert sum(b"PUB" in data for data in writes) == 1


async def test_burst_arrives_in_order_with_excess_dropped(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        recorder = MessageRecorder()
        one.subscribe("a", recorder)
        await flush_buses(one)
        # the event loop reads nothing meanwhile: sockets and send buffer hold the messages
        for number in range(100_000):
            two.publish("a", b"%08d" % number + bytes(200))
        await wait_until(lambda: two._connection is not None and not two._connection.unsent_bytes)
        two.publish("a", b"last")
        messages = await recorder.wait_for(b"last")
        assert 1000 < len(messages) <= 100_001
        assert messages[:-1] == sorted(set(messages[:-1]))


async def test_bus_opens_without_a_server_and_connects_later(server: ServerProcess) -> None:
    server.stop()
    async with connect_buses(nats_url_of(server), connect_timeout_s=0.01) as (bus,):
        reconnected = asyncio.Event()
        bus.on_reconnect(reconnected.set)
        bus.serve("echo", echo)
        with pytest.raises(BackendUnavailable):
            await bus.request("echo", b"0")
        server.start()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await reconnected.wait()
        assert await bus.request("echo", b"1") == b"1"


async def test_ended_reconnect_handler_is_not_called(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        calls: list[str] = []
        bus.on_reconnect(lambda: calls.append("kept"))
        subscription = bus.on_reconnect(lambda: calls.append("ended"))

        def broken() -> None:
            raise RuntimeError("a broken handler")

        bus.on_reconnect(broken)
        bus.on_reconnect(lambda: calls.append("last"))
        subscription.unsubscribe()
        server.kill()
        await wait_until(lambda: not bus.is_connected)
        server.start()
        await wait_until(lambda: "last" in calls)
        assert calls == ["kept", "last"]


async def test_bus_fails_over_to_another_server(server: ServerProcess, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    with run_nats_server(tmp_path / "other") as other:
        server.stop()
        url = f"nats://127.0.0.1:{server.port},127.0.0.1:{other.port}"
        async with connect_buses(url) as (bus,):
            bus.serve("echo", echo)
            assert await bus.request("echo", b"1") == b"1"
            other.kill()
            await wait_until(lambda: not bus.is_connected)
            server.start()
            await wait_until(lambda: bus.is_connected)
            assert await bus.request("echo", b"2") == b"2"


async def test_rejected_login_is_tried_again(tmp_path: Path) -> None:
    with run_nats_server(tmp_path, "--auth", "secret") as server:
        async with connect_buses(nats_url_of(server), connect_timeout_s=0.5) as (bus,):
            assert not bus.is_connected
            server.stop()
            server.command = server.command[:-2]
            server.start()
            await wait_until(lambda: bus.is_connected)
    with run_nats_server(tmp_path, "--auth", "secret") as server:
        async with connect_buses(f"nats://secret@127.0.0.1:{server.port}") as (bus,):
            assert bus.is_connected
    with run_nats_server(tmp_path, "--user", "me", "--pass", "word") as server:
        async with connect_buses(f"nats://me:word@127.0.0.1:{server.port}") as (bus,):
            assert bus.is_connected


async def test_oversized_message_is_dropped_alone(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        recorder = MessageRecorder()
        bus.subscribe("a", recorder)
        bus.serve("echo", echo)
        await flush_buses(bus)
        with pytest.raises(ValueError, match="1048576"):
            await bus.request("echo", bytes((1 << 20) + 1))
        server.stop()
        server.command += ["-c", "nats.conf"]
        (server.folder / "nats.conf").write_text("max_payload: 1000\n")
        await wait_until(lambda: not bus.is_connected)
        server.start()
        await wait_until(lambda: bus.is_connected)
        bus.publish("a", bytes(1001))
        bus.publish("a", b"small")
        assert await recorder.wait_for(b"small") == [b"small"]


async def test_each_request_goes_to_one_of_several_responders(server: ServerProcess) -> None:
    async with connect_buses(*[nats_url_of(server)] * 3) as (one, two, three):
        received: list[bytes] = []

        async def note(data: bytes) -> bytes:
            received.append(data)
            return data

        one.serve("note", note)
        two.serve("note", note)
        await flush_buses(one, two)
        requests = [b"%d" % number for number in range(40)]
        assert await asyncio.gather(*(three.request("note", request) for request in requests)) == requests
        assert sorted(received) == sorted(requests)


async def test_bus_closes_in_any_state(server: ServerProcess) -> None:
    bus = NatsBus(nats_url_of(server))
    await bus.close()
    bus = NatsBus(nats_url_of(server))
    opening = asyncio.create_task(bus.open())
    await asyncio.sleep(0)
    await bus.close()
    await opening
    async with connect_buses(nats_url_of(server)) as (bus,):
        bus.serve("never", lambda _: asyncio.get_running_loop().create_future())
        pending = asyncio.create_task(bus.request("never", timeout_s=3600))
        await wait_until(lambda: bool(bus._response_tasks))
        await bus.close()
        with pytest.raises(BackendUnavailable):
            await pending


def test_bus_works_on_uvloop(server: ServerProcess) -> None:
    async def scenario() -> None:
        async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
            recorder = MessageRecorder()
            one.subscribe("a", recorder)
            one.serve("echo", echo)
            await flush_buses(one)
            expected = [b"%d" % number for number in range(5000)]
            for message in expected:
                two.publish("a", message)
            assert await recorder.wait_for(expected[-1]) == expected
            assert await two.request("echo", b"1") == b"1"
            server.pause()
            while two.is_connected:
                two.publish("b", bytes(10_000))
                assert (
                    two._connection is None or two._connection.unsent_bytes <= nats_connection.MAX_UNSENT_BYTES + 20_000
                )
                await asyncio.sleep(0)
            server.kill()
            server.start()
            await wait_until(lambda: one.is_connected and two.is_connected)
            two.publish("a", b"after")
            await recorder.wait_for(b"after")

    uvloop.run(scenario())


def test_server_addresses_are_parsed() -> None:
    servers = parse_servers("nats://a:1,b,nats://[::1]:2,token@c,me:w%40rd@d:3")
    assert servers == [
        NatsServer("a", 1, {}),
        NatsServer("b", 4222, {}),
        NatsServer("::1", 2, {}),
        NatsServer("c", 4222, {"auth_token": "token"}),
        NatsServer("d", 3, {"user": "me", "pass": "w@rd"}),
    ]
    for wrong in ("nats:", "nats://", "nats://a:x", "nats://a:99999", "http://a", "nats://a/b", "nats://a,,b", ""):
        with pytest.raises(ValueError, match="nats://host"):
            parse_servers(wrong)
