"""What holds of every bus: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator

import pytest

from bunraku.messaging.bus import Bus, MemoryBus, NoResponse, ResponderFailed, is_subject
from bunraku.messaging.bus_nats import NatsBus
from bunraku.runtime.availability import BackendUnavailable


@pytest.fixture(params=["memory", "nats"])
async def buses(request: pytest.FixtureRequest) -> AsyncIterator[tuple[Bus, Bus]]:
    """The bus as two services see it: the same one in one process, two connections between two."""
    if request.param == "memory":
        bus = MemoryBus()
        yield bus, bus
        await bus.close()
        return
    url = request.getfixturevalue("nats_url")
    one, two = NatsBus(url), NatsBus(url)
    await one.open()
    await two.open()
    yield one, two
    await one.close()
    await two.close()


class MessageRecorder:
    """What came, and a way to wait for it."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self._received = asyncio.Event()

    def __call__(self, message: bytes) -> None:
        self.messages.append(message)
        self._received.set()

    async def wait_for(self, last: bytes) -> list[bytes]:
        async with asyncio.timeout(20):
            while not self.messages or self.messages[-1] != last:
                self._received.clear()
                await self._received.wait()
        return self.messages


async def flush_buses(*buses: Bus) -> None:
    """Until what was said before holds everywhere: an answer comes after it."""
    for bus in buses:

        async def nothing(_: bytes) -> bytes:
            return b""

        subject = f"settled.{id(bus)}"
        answering = bus.serve(subject, nothing)
        await bus.request(subject)
        answering.unsubscribe()


async def test_a_bus_is_up(buses: tuple[Bus, Bus]) -> None:
    assert all(bus.is_connected for bus in buses)


async def test_messages_reach_all_who_listen_in_order_until_they_end(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    first, second, third, elsewhere = MessageRecorder(), MessageRecorder(), MessageRecorder(), MessageRecorder()
    one = bus.subscribe("a.b", first)
    bus.subscribe("a.b", second)
    other.subscribe("a.b", third)
    other.subscribe("a.c", elsewhere)
    await flush_buses(bus, other)
    for number in range(1000):
        bus.publish("a.b", b"%d" % number)
    expected = [b"%d" % number for number in range(1000)]
    for heard in (first, second, third):
        assert await heard.wait_for(b"999") == expected
    one.unsubscribe()
    one.unsubscribe()
    bus.publish("a.b", b"last")
    await second.wait_for(b"last")
    await third.wait_for(b"last")
    assert first.messages == expected
    assert elsewhere.messages == []


async def test_a_subscription_holds_for_what_is_published_next(buses: tuple[Bus, Bus]) -> None:
    bus, _ = buses
    for number in range(20):
        heard = MessageRecorder()
        listening = bus.subscribe("a", heard)
        bus.publish("a", b"%d" % number)
        assert await heard.wait_for(b"%d" % number) == [b"%d" % number]
        listening.unsubscribe()


async def test_questions_are_answered_until_the_answerer_ends(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def twice(data: bytes) -> bytes:
        return data * 2

    answering = bus.serve("double", twice)
    await flush_buses(bus)
    assert await other.request("double", b"ab") == b"abab"
    assert await bus.request("double", b"") == b""
    answers = await asyncio.gather(*(other.request("double", b"%d" % number) for number in range(50)))
    assert answers == [b"%d" % number * 2 for number in range(50)]
    answering.unsubscribe()
    await flush_buses(bus)
    with pytest.raises(NoResponse):
        await other.request("double", b"ab")


async def test_a_slow_answer_keeps_no_other_waiting(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    go = asyncio.Event()

    async def when_told(data: bytes) -> bytes:
        if data == b"slow":
            await go.wait()
        return data

    bus.serve("told", when_told)
    await flush_buses(bus)
    slow = asyncio.create_task(other.request("told", b"slow", 20))
    assert await other.request("told", b"quick") == b"quick"
    assert not slow.done()
    go.set()
    assert await slow == b"slow"


async def test_a_question_without_an_answer_ends(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def never(_: bytes) -> bytes:
        await asyncio.Event().wait()
        return b""

    bus.serve("silence", never)
    await flush_buses(bus)
    with pytest.raises(NoResponse):
        await other.request("silence", timeout_s=0.05)


async def test_an_answer_that_fails_is_known_at_once(buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture) -> None:
    bus, other = buses

    async def broken(data: bytes) -> bytes:
        raise BackendUnavailable("the catalogue", "it is Sunday") if data else RuntimeError("broken")

    bus.serve("broken", broken)
    await flush_buses(bus)
    async with asyncio.timeout(30):
        with caplog.at_level(logging.CRITICAL, "bunraku.messaging.bus"), pytest.raises(ResponderFailed):
            await other.request("broken", timeout_s=3600)
        with pytest.raises(BackendUnavailable) as told:
            await other.request("broken", b"1", 3600)
    assert told.value.backend == "the catalogue"


async def test_nobody_is_known_at_once(buses: tuple[Bus, Bus]) -> None:
    async with asyncio.timeout(30):
        with pytest.raises(NoResponse):
            await buses[1].request("nobody.here", timeout_s=3600)


async def test_what_a_handler_raises_is_its_own_trouble(
    buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture
) -> None:
    bus, other = buses
    heard = MessageRecorder()

    def broken(_: bytes) -> None:
        raise RuntimeError("a broken handler")

    other.subscribe("a", broken)
    other.subscribe("a", heard)
    await flush_buses(other)
    with caplog.at_level(logging.CRITICAL, "bunraku.messaging.bus"):
        bus.publish("a", b"1")
        bus.publish("a", b"2")
        assert await heard.wait_for(b"2") == [b"1", b"2"]


@pytest.mark.parametrize("size", [0, 1, 70_000, 1 << 20])
async def test_messages_of_all_sizes_come_as_they_are(buses: tuple[Bus, Bus], size: int) -> None:
    bus, other = buses
    heard = MessageRecorder()
    other.subscribe("a", heard)
    await flush_buses(other)
    message = (b"\r\nPUB a 1\r\n\x00\xff" * (size // 8 + 1))[:size]
    bus.publish("a", message)
    assert await heard.wait_for(message) == [message]


@pytest.mark.parametrize("subject", ["", "a..b", ".a", "a.", "a b", "a\r\nPUB b 0", "a.*", ">", "a\x00b", "a" * 257])
async def test_what_is_no_subject_reaches_nobody(buses: tuple[Bus, Bus], subject: str) -> None:
    bus, _ = buses

    async def nothing(_: bytes) -> bytes:
        return b""

    assert not is_subject(subject)
    with pytest.raises(NoResponse):
        await bus.request(subject)
    with pytest.raises(ValueError, match="subject"):
        bus.publish(subject, b"")
    with pytest.raises(ValueError, match="subject"):
        bus.subscribe(subject, MessageRecorder())
    with pytest.raises(ValueError, match="subject"):
        bus.serve(subject, nothing)
    assert bus.is_connected


async def test_a_closed_bus_is_silent(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    heard = MessageRecorder()
    bus.subscribe("a", heard)
    await flush_buses(bus)
    await bus.close()
    other.publish("a", b"1")
    bus.publish("a", b"2")
    await flush_buses(other)
    assert heard.messages == []
