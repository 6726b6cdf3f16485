"""The bus when its server is away, stands still, refuses, or cannot keep up."""

from __future__ import annotations

import asyncio
import tracemalloc
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
import uvloop

from bunraku.backing import nats_link
from bunraku.backing.bus import NobodyAnswers
from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.nats_link import Server, read_servers
from bunraku.backing.unavailable import Unavailable
from tests.backing.test_bus import Heard, settled
from tests.processes import Owned, nats_server, url_of


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Owned]:
    with nats_server(tmp_path) as owned:
        yield owned


@asynccontextmanager
async def connected(*urls: str, wait: float = 20) -> AsyncIterator[list[NatsBus]]:
    buses = [NatsBus(url) for url in urls]
    try:
        for bus in buses:
            await bus.open(wait)
        yield buses
    finally:
        for bus in buses:
            await bus.close()


async def until(holds: Callable[[], bool]) -> None:
    """Until something holds that nobody tells of."""
    async with asyncio.timeout(30):
        while not holds():  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def echo(data: bytes) -> bytes:
    return data


async def test_after_a_server_was_killed_all_goes_on_with_its_next_start(server: Owned) -> None:
    async with connected(url_of(server), url_of(server)) as (one, two):
        heard, back = Heard(), asyncio.Event()
        one.subscribe("a", heard)
        one.answer("echo", echo)
        one.on_return(back.set)
        await settled(one, two)
        two.publish("a", b"before")
        await heard.until(b"before")
        asking = asyncio.create_task(two.ask("nobody.reads", b"", 3600))
        server.kill()
        await until(lambda: not one.up and not two.up)
        with pytest.raises((Unavailable, NobodyAnswers)):
            await asking
        with pytest.raises(Unavailable, match="bus"):
            await two.ask("echo", b"1")
        for _ in range(1000):
            two.publish("a", b"lost")
        while_away = Heard()
        one.subscribe("b", while_away)
        ended = one.subscribe("c", heard)
        ended.end()
        assert not back.is_set()
        server.start()
        async with asyncio.timeout(30):
            await back.wait()
        await until(lambda: two.up)
        assert await two.ask("echo", b"2") == b"2"
        for subject in ("c", "a", "b"):
            two.publish(subject, b"after")
        assert await heard.until(b"after") == [b"before", b"after"]
        assert await while_away.until(b"after") == [b"after"]


async def test_a_stream_through_a_restart_has_a_gap_and_no_message_twice(server: Owned) -> None:
    async with connected(url_of(server), url_of(server)) as (one, two):
        heard = Heard()
        one.subscribe("a", heard)
        await settled(one)

        async def stream() -> None:
            number = 0
            while True:
                two.publish("a", b"%06d" % number)
                number += 1
                await asyncio.sleep(0)

        streaming = asyncio.create_task(stream())
        await until(lambda: len(heard.messages) > 100)
        server.kill()
        server.start()
        await until(lambda: one.up and two.up)
        before = len(heard.messages)
        await until(lambda: len(heard.messages) > before + 100)
        streaming.cancel()
        assert heard.messages == sorted(set(heard.messages))


@pytest.mark.parametrize("beats", [nats_link.BEATS, 1_000])
async def test_a_server_that_stands_still_is_away_until_it_goes_on(
    server: Owned, beats: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # found out by its beats, or by a question over which nothing at all came
    monkeypatch.setattr(nats_link, "BEATS", beats)
    async with connected(url_of(server)) as (bus,):
        bus.answer("echo", echo)
        await settled(bus)
        server.pause()
        with pytest.raises(Unavailable):
            await bus.ask("echo", b"1")
        assert not bus.up
        server.resume()
        await until(lambda: bus.up)
        assert await bus.ask("echo", b"2") == b"2"


async def test_what_a_server_does_not_take_is_lost_and_not_kept(server: Owned) -> None:
    async with connected(url_of(server)) as (bus,):
        server.pause()
        link = bus._link
        assert link is not None
        tracemalloc.start()
        try:
            while bus.up:
                for number in range(1000):
                    bus.publish("a", b"%d" % number + bytes(10_000))
                assert link.waiting <= nats_link.WAITING + 20_000
                await asyncio.sleep(0)
            _, most = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert most < 3 * nats_link.WAITING
        # it closes while the server stands


async def test_a_flood_comes_in_order_with_what_was_too_much_left_out(server: Owned) -> None:
    async with connected(url_of(server), url_of(server)) as (one, two):
        heard = Heard()
        one.subscribe("a", heard)
        await settled(one)
        # nothing is read meanwhile: the server has what the sockets hold, and the rest waits
        for number in range(100_000):
            two.publish("a", b"%08d" % number + bytes(200))
        await until(lambda: two._link is not None and not two._link.waiting)
        two.publish("a", b"last")
        messages = await heard.until(b"last")
        assert 1000 < len(messages) <= 100_001
        assert messages[:-1] == sorted(set(messages[:-1]))


async def test_it_opens_without_a_server_and_connects_when_there_is_one(server: Owned) -> None:
    server.stop()
    async with connected(url_of(server), wait=0.01) as (bus,):
        back = asyncio.Event()
        bus.on_return(back.set)
        bus.answer("echo", echo)
        with pytest.raises(Unavailable):
            await bus.ask("echo", b"0")
        server.start()
        async with asyncio.timeout(30):
            await back.wait()
        assert await bus.ask("echo", b"1") == b"1"


async def test_who_no_longer_wants_to_know_is_not_told(server: Owned) -> None:
    async with connected(url_of(server)) as (bus,):
        told: list[str] = []
        bus.on_return(lambda: told.append("kept"))
        ended = bus.on_return(lambda: told.append("ended"))

        def broken() -> None:
            raise RuntimeError("a broken handler")

        bus.on_return(broken)
        bus.on_return(lambda: told.append("last"))
        ended.end()
        server.kill()
        await until(lambda: not bus.up)
        server.start()
        await until(lambda: "last" in told)
        assert told == ["kept", "last"]


async def test_any_server_of_several_will_do(server: Owned, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    with nats_server(tmp_path / "other") as other:
        server.stop()
        url = f"nats://127.0.0.1:{server.port},127.0.0.1:{other.port}"
        async with connected(url) as (bus,):
            bus.answer("echo", echo)
            assert await bus.ask("echo", b"1") == b"1"
            other.kill()
            await until(lambda: not bus.up)
            server.start()
            await until(lambda: bus.up)
            assert await bus.ask("echo", b"2") == b"2"


async def test_a_server_that_refused_is_tried_again(tmp_path: Path) -> None:
    with nats_server(tmp_path, "--auth", "secret") as server:
        async with connected(url_of(server), wait=0.5) as (bus,):
            assert not bus.up
            server.stop()
            server.command = server.command[:-2]
            server.start()
            await until(lambda: bus.up)
    with nats_server(tmp_path, "--auth", "secret") as server:
        async with connected(f"nats://secret@127.0.0.1:{server.port}") as (bus,):
            assert bus.up
    with nats_server(tmp_path, "--user", "me", "--pass", "word") as server:
        async with connected(f"nats://me:word@127.0.0.1:{server.port}") as (bus,):
            assert bus.up


async def test_what_is_too_large_is_said_and_nothing_else_suffers(server: Owned) -> None:
    async with connected(url_of(server)) as (bus,):
        heard = Heard()
        bus.subscribe("a", heard)
        bus.answer("echo", echo)
        await settled(bus)
        with pytest.raises(ValueError, match="1048576"):
            await bus.ask("echo", bytes((1 << 20) + 1))
        server.stop()
        server.command += ["-c", "nats.conf"]
        (server.folder / "nats.conf").write_text("max_payload: 1000\n")
        await until(lambda: not bus.up)
        server.start()
        await until(lambda: bus.up)
        bus.publish("a", bytes(1001))
        bus.publish("a", b"small")
        assert await heard.until(b"small") == [b"small"]


async def test_each_question_goes_to_one_of_several(server: Owned) -> None:
    async with connected(*[url_of(server)] * 3) as (one, two, three):
        asked: list[bytes] = []

        async def note(data: bytes) -> bytes:
            asked.append(data)
            return data

        one.answer("note", note)
        two.answer("note", note)
        await settled(one, two)
        questions = [b"%d" % number for number in range(40)]
        assert await asyncio.gather(*(three.ask("note", question) for question in questions)) == questions
        assert sorted(asked) == sorted(questions)


async def test_it_closes_at_any_time(server: Owned) -> None:
    bus = NatsBus(url_of(server))
    await bus.close()
    bus = NatsBus(url_of(server))
    opening = asyncio.create_task(bus.open())
    await asyncio.sleep(0)
    await bus.close()
    await opening
    async with connected(url_of(server)) as (bus,):
        bus.answer("never", lambda _: asyncio.get_running_loop().create_future())
        asking = asyncio.create_task(bus.ask("never", seconds=3600))
        await until(lambda: bool(bus._replying))
        await bus.close()
        with pytest.raises(Unavailable):
            await asking


def test_it_is_the_same_on_the_loop_that_the_services_have(server: Owned) -> None:
    async def scenario() -> None:
        async with connected(url_of(server), url_of(server)) as (one, two):
            heard = Heard()
            one.subscribe("a", heard)
            one.answer("echo", echo)
            await settled(one)
            expected = [b"%d" % number for number in range(5000)]
            for message in expected:
                two.publish("a", message)
            assert await heard.until(expected[-1]) == expected
            assert await two.ask("echo", b"1") == b"1"
            server.pause()
            while two.up:
                two.publish("b", bytes(10_000))
                assert two._link is None or two._link.waiting <= nats_link.WAITING + 20_000
                await asyncio.sleep(0)
            server.kill()
            server.start()
            await until(lambda: one.up and two.up)
            two.publish("a", b"after")
            await heard.until(b"after")

    uvloop.run(scenario())


def test_addresses() -> None:
    servers = read_servers("nats://a:1,b,nats://[::1]:2,token@c,me:w%40rd@d:3")
    assert servers == [
        Server("a", 1, {}),
        Server("b", 4222, {}),
        Server("::1", 2, {}),
        Server("c", 4222, {"auth_token": "token"}),
        Server("d", 3, {"user": "me", "pass": "w@rd"}),
    ]
    for wrong in ("nats:", "nats://", "nats://a:x", "nats://a:99999", "http://a", "nats://a/b", "nats://a,,b", ""):
        with pytest.raises(ValueError, match="nats://host"):
            read_servers(wrong)
