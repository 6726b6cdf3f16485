"""The bus when its server is away, stands still, refuses, or cannot keep up."""

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
from bunraku.messaging.nats_connection import NatsServer, parse_servers
from bunraku.runtime.availability import BackendUnavailable
from tests.messaging.test_bus import MessageRecorder, flush_buses
from tests.processes import ServerProcess, nats_url_of, run_nats_server


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ServerProcess]:
    with run_nats_server(tmp_path) as owned:
        yield owned


@asynccontextmanager
async def connect_buses(*urls: str, wait: float = 20) -> AsyncIterator[list[NatsBus]]:
    buses = [NatsBus(url) for url in urls]
    try:
        for bus in buses:
            await bus.open(wait)
        yield buses
    finally:
        for bus in buses:
            await bus.close()


async def wait_until(holds: Callable[[], bool]) -> None:
    """Until something holds that nobody tells of."""
    async with asyncio.timeout(30):
        while not holds():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def echo(data: bytes) -> bytes:
    return data


async def test_after_a_server_was_killed_all_goes_on_with_its_next_start(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        heard, back = MessageRecorder(), asyncio.Event()
        one.subscribe("a", heard)
        one.serve("echo", echo)
        one.on_reconnect(back.set)
        await flush_buses(one, two)
        two.publish("a", b"before")
        await heard.wait_for(b"before")
        asking = asyncio.create_task(two.request("nobody.reads", b"", 3600))
        server.kill()
        await wait_until(lambda: not one.is_connected and not two.is_connected)
        with pytest.raises((BackendUnavailable, NoResponse)):
            await asking
        with pytest.raises(BackendUnavailable, match="bus"):
            await two.request("echo", b"1")
        for _ in range(1000):
            two.publish("a", b"lost")
        while_away = MessageRecorder()
        one.subscribe("b", while_away)
        ended = one.subscribe("c", heard)
        ended.unsubscribe()
        assert not back.is_set()
        server.start()
        async with asyncio.timeout(30):
            await back.wait()
        await wait_until(lambda: two.is_connected)
        assert await two.request("echo", b"2") == b"2"
        for subject in ("c", "a", "b"):
            two.publish(subject, b"after")
        assert await heard.wait_for(b"after") == [b"before", b"after"]
        assert await while_away.wait_for(b"after") == [b"after"]


async def test_a_stream_through_a_restart_has_a_gap_and_no_message_twice(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        heard = MessageRecorder()
        one.subscribe("a", heard)
        await flush_buses(one)

        async def stream() -> None:
            number = 0
            while True:
                two.publish("a", b"%06d" % number)
                number += 1
                await asyncio.sleep(0)

        streaming = asyncio.create_task(stream())
        await wait_until(lambda: len(heard.messages) > 100)
        server.kill()
        server.start()
        await wait_until(lambda: one.is_connected and two.is_connected)
        before = len(heard.messages)
        await wait_until(lambda: len(heard.messages) > before + 100)
        streaming.cancel()
        assert heard.messages == sorted(set(heard.messages))


@pytest.mark.parametrize("beats", [nats_connection.MAX_MISSED_HEARTBEATS, 1_000])
async def test_a_server_that_stands_still_is_away_until_it_goes_on(
    server: ServerProcess, beats: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # found out by its beats, or by a question over which nothing at all came
    monkeypatch.setattr(nats_connection, "MAX_MISSED_HEARTBEATS", beats)
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


async def test_what_a_server_does_not_take_is_lost_and_not_kept(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        server.pause()
        link = bus._connection
        assert link is not None
        tracemalloc.start()
        try:
            while bus.is_connected:
                for number in range(1000):
                    bus.publish("a", b"%d" % number + bytes(10_000))
                assert link.unsent_bytes <= nats_connection.MAX_UNSENT_BYTES + 20_000
                await asyncio.sleep(0)
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert most < 3 * nats_connection.MAX_UNSENT_BYTES
        # it closes while the server stands


async def test_a_flood_comes_in_order_with_what_was_too_much_left_out(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
        heard = MessageRecorder()
        one.subscribe("a", heard)
        await flush_buses(one)
        # nothing is read meanwhile: the server has what the sockets hold, and the rest waits
        for number in range(100_000):
            two.publish("a", b"%08d" % number + bytes(200))
        await wait_until(lambda: two._connection is not None and not two._connection.unsent_bytes)
        two.publish("a", b"last")
        messages = await heard.wait_for(b"last")
        assert 1000 < len(messages) <= 100_001
        assert messages[:-1] == sorted(set(messages[:-1]))


async def test_it_opens_without_a_server_and_connects_when_there_is_one(server: ServerProcess) -> None:
    server.stop()
    async with connect_buses(nats_url_of(server), wait=0.01) as (bus,):
        back = asyncio.Event()
        bus.on_reconnect(back.set)
        bus.serve("echo", echo)
        with pytest.raises(BackendUnavailable):
            await bus.request("echo", b"0")
        server.start()
        async with asyncio.timeout(30):
            await back.wait()
        assert await bus.request("echo", b"1") == b"1"


async def test_who_no_longer_wants_to_know_is_not_told(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        told: list[str] = []
        bus.on_reconnect(lambda: told.append("kept"))
        ended = bus.on_reconnect(lambda: told.append("ended"))

        def broken() -> None:
            raise RuntimeError("a broken handler")

        bus.on_reconnect(broken)
        bus.on_reconnect(lambda: told.append("last"))
        ended.unsubscribe()
        server.kill()
        await wait_until(lambda: not bus.is_connected)
        server.start()
        await wait_until(lambda: "last" in told)
        assert told == ["kept", "last"]


async def test_any_server_of_several_will_do(server: ServerProcess, tmp_path: Path) -> None:
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


async def test_a_server_that_refused_is_tried_again(tmp_path: Path) -> None:
    with run_nats_server(tmp_path, "--auth", "secret") as server:
        async with connect_buses(nats_url_of(server), wait=0.5) as (bus,):
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


async def test_what_is_too_large_is_said_and_nothing_else_suffers(server: ServerProcess) -> None:
    async with connect_buses(nats_url_of(server)) as (bus,):
        heard = MessageRecorder()
        bus.subscribe("a", heard)
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
        assert await heard.wait_for(b"small") == [b"small"]


async def test_each_question_goes_to_one_of_several(server: ServerProcess) -> None:
    async with connect_buses(*[nats_url_of(server)] * 3) as (one, two, three):
        asked: list[bytes] = []

        async def note(data: bytes) -> bytes:
            asked.append(data)
            return data

        one.serve("note", note)
        two.serve("note", note)
        await flush_buses(one, two)
        questions = [b"%d" % number for number in range(40)]
        assert await asyncio.gather(*(three.request("note", question) for question in questions)) == questions
        assert sorted(asked) == sorted(questions)


async def test_it_closes_at_any_time(server: ServerProcess) -> None:
    bus = NatsBus(nats_url_of(server))
    await bus.close()
    bus = NatsBus(nats_url_of(server))
    opening = asyncio.create_task(bus.open())
    await asyncio.sleep(0)
    await bus.close()
    await opening
    async with connect_buses(nats_url_of(server)) as (bus,):
        bus.serve("never", lambda _: asyncio.get_running_loop().create_future())
        asking = asyncio.create_task(bus.request("never", timeout_s=3600))
        await wait_until(lambda: bool(bus._response_tasks))
        await bus.close()
        with pytest.raises(BackendUnavailable):
            await asking


def test_it_is_the_same_on_the_loop_that_the_services_have(server: ServerProcess) -> None:
    async def scenario() -> None:
        async with connect_buses(nats_url_of(server), nats_url_of(server)) as (one, two):
            heard = MessageRecorder()
            one.subscribe("a", heard)
            one.serve("echo", echo)
            await flush_buses(one)
            expected = [b"%d" % number for number in range(5000)]
            for message in expected:
                two.publish("a", message)
            assert await heard.wait_for(expected[-1]) == expected
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
            await heard.wait_for(b"after")

    uvloop.run(scenario())


def test_addresses() -> None:
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
