"""What holds of every bus: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator

import pytest

from bunraku.backing.bus import AnswerFailed, Bus, MemoryBus, NobodyAnswers, sayable
from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.unavailable import Unavailable


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


class Heard:
    """What came, and a way to wait for it."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self._came = asyncio.Event()

    def __call__(self, message: bytes) -> None:
        self.messages.append(message)
        self._came.set()

    async def until(self, last: bytes) -> list[bytes]:
        async with asyncio.timeout(20):
            while not self.messages or self.messages[-1] != last:
                self._came.clear()
                await self._came.wait()
        return self.messages


async def settled(*buses: Bus) -> None:
    """Until what was said before holds everywhere: an answer comes after it."""
    for bus in buses:

        async def nothing(_: bytes) -> bytes:
            return b""

        subject = f"settled.{id(bus)}"
        answering = bus.answer(subject, nothing)
        await bus.ask(subject)
        answering.end()


async def test_a_bus_is_up(buses: tuple[Bus, Bus]) -> None:
    assert all(bus.up for bus in buses)


async def test_messages_reach_all_who_listen_in_order_until_they_end(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    first, second, third, elsewhere = Heard(), Heard(), Heard(), Heard()
    one = bus.subscribe("a.b", first)
    bus.subscribe("a.b", second)
    other.subscribe("a.b", third)
    other.subscribe("a.c", elsewhere)
    await settled(bus, other)
    for number in range(1000):
        bus.publish("a.b", b"%d" % number)
    expected = [b"%d" % number for number in range(1000)]
    for heard in (first, second, third):
        assert await heard.until(b"999") == expected
    one.end()
    one.end()
    bus.publish("a.b", b"last")
    await second.until(b"last")
    await third.until(b"last")
    assert first.messages == expected
    assert elsewhere.messages == []


async def test_a_subscription_holds_for_what_is_published_next(buses: tuple[Bus, Bus]) -> None:
    bus, _ = buses
    for number in range(20):
        heard = Heard()
        listening = bus.subscribe("a", heard)
        bus.publish("a", b"%d" % number)
        assert await heard.until(b"%d" % number) == [b"%d" % number]
        listening.end()


async def test_questions_are_answered_until_the_answerer_ends(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def twice(data: bytes) -> bytes:
        return data * 2

    answering = bus.answer("double", twice)
    await settled(bus)
    assert await other.ask("double", b"ab") == b"abab"
    assert await bus.ask("double", b"") == b""
    answers = await asyncio.gather(*(other.ask("double", b"%d" % number) for number in range(50)))
    assert answers == [b"%d" % number * 2 for number in range(50)]
    answering.end()
    await settled(bus)
    with pytest.raises(NobodyAnswers):
        await other.ask("double", b"ab")


async def test_a_slow_answer_keeps_no_other_waiting(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    go = asyncio.Event()

    async def when_told(data: bytes) -> bytes:
        if data == b"slow":
            await go.wait()
        return data

    bus.answer("told", when_told)
    await settled(bus)
    slow = asyncio.create_task(other.ask("told", b"slow", 20))
    assert await other.ask("told", b"quick") == b"quick"
    assert not slow.done()
    go.set()
    assert await slow == b"slow"


async def test_a_question_without_an_answer_ends(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def never(_: bytes) -> bytes:
        await asyncio.Event().wait()
        return b""

    bus.answer("silence", never)
    await settled(bus)
    with pytest.raises(NobodyAnswers):
        await other.ask("silence", seconds=0.05)


async def test_an_answer_that_fails_is_known_at_once(buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture) -> None:
    bus, other = buses

    async def broken(data: bytes) -> bytes:
        raise Unavailable("the catalogue", "it is Sunday") if data else RuntimeError("broken")

    bus.answer("broken", broken)
    await settled(bus)
    async with asyncio.timeout(30):
        with caplog.at_level(logging.CRITICAL, "bunraku.backing.bus"), pytest.raises(AnswerFailed):
            await other.ask("broken", seconds=3600)
        with pytest.raises(Unavailable) as told:
            await other.ask("broken", b"1", 3600)
    assert told.value.what == "the catalogue"


async def test_nobody_is_known_at_once(buses: tuple[Bus, Bus]) -> None:
    async with asyncio.timeout(30):
        with pytest.raises(NobodyAnswers):
            await buses[1].ask("nobody.here", seconds=3600)


async def test_what_a_handler_raises_is_its_own_trouble(
    buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture
) -> None:
    bus, other = buses
    heard = Heard()

    def broken(_: bytes) -> None:
        raise RuntimeError("a broken handler")

    other.subscribe("a", broken)
    other.subscribe("a", heard)
    await settled(other)
    with caplog.at_level(logging.CRITICAL, "bunraku.backing.bus"):
        bus.publish("a", b"1")
        bus.publish("a", b"2")
        assert await heard.until(b"2") == [b"1", b"2"]


@pytest.mark.parametrize("size", [0, 1, 70_000, 1 << 20])
async def test_messages_of_all_sizes_come_as_they_are(buses: tuple[Bus, Bus], size: int) -> None:
    bus, other = buses
    heard = Heard()
    other.subscribe("a", heard)
    await settled(other)
    message = (b"\r\nPUB a 1\r\n\x00\xff" * (size // 8 + 1))[:size]
    bus.publish("a", message)
    assert await heard.until(message) == [message]


@pytest.mark.parametrize("subject", ["", "a..b", ".a", "a.", "a b", "a\r\nPUB b 0", "a.*", ">", "a\x00b", "a" * 257])
async def test_what_is_no_subject_reaches_nobody(buses: tuple[Bus, Bus], subject: str) -> None:
    bus, _ = buses

    async def nothing(_: bytes) -> bytes:
        return b""

    assert not sayable(subject)
    with pytest.raises(NobodyAnswers):
        await bus.ask(subject)
    with pytest.raises(ValueError, match="subject"):
        bus.publish(subject, b"")
    with pytest.raises(ValueError, match="subject"):
        bus.subscribe(subject, Heard())
    with pytest.raises(ValueError, match="subject"):
        bus.answer(subject, nothing)
    assert bus.up


async def test_a_closed_bus_is_silent(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    heard = Heard()
    bus.subscribe("a", heard)
    await settled(bus)
    await bus.close()
    other.publish("a", b"1")
    bus.publish("a", b"2")
    await settled(other)
    assert heard.messages == []
