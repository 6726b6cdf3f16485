"""Behaviour common to all buses: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator

import pytest

from bunraku.messaging.bus import Bus, MemoryBus, NoResponse, ResponderFailed, is_subject
from bunraku.messaging.bus_nats import NatsBus
from bunraku.runtime.availability import BackendUnavailable
from tests.messaging.message_recorder import MessageRecorder, flush_buses
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture(params=["memory", "nats"])
async def buses(request: pytest.FixtureRequest) -> AsyncIterator[tuple[Bus, Bus]]:
    """Return the bus as two services use it: one object in one process, two connections over NATS."""
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


async def test_bus_is_connected(buses: tuple[Bus, Bus]) -> None:
    assert all(bus.is_connected for bus in buses)


async def test_messages_reach_all_subscribers_in_order(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    first, second, third, other_subject = (MessageRecorder() for _ in range(4))
    subscription = bus.subscribe("a.b", first)
    bus.subscribe("a.b", second)
    other.subscribe("a.b", third)
    other.subscribe("a.c", other_subject)
    await flush_buses(bus, other)
    for number in range(1000):
        bus.publish("a.b", b"%d" % number)
    expected = [b"%d" % number for number in range(1000)]
    for recorder in (first, second, third):
        assert await recorder.wait_for(b"999") == expected
    subscription.unsubscribe()
    subscription.unsubscribe()
    bus.publish("a.b", b"last")
    await second.wait_for(b"last")
    await third.wait_for(b"last")
    assert first.messages == expected
    assert other_subject.messages == []


async def test_subscription_receives_the_next_message(buses: tuple[Bus, Bus]) -> None:
    bus, _ = buses
    for number in range(20):
        recorder = MessageRecorder()
        subscription = bus.subscribe("a", recorder)
        bus.publish("a", b"%d" % number)
        assert await recorder.wait_for(b"%d" % number) == [b"%d" % number]
        subscription.unsubscribe()


async def test_requests_are_answered_until_the_responder_ends(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def twice(data: bytes) -> bytes:
        return data * 2

    subscription = bus.serve("double", twice)
    await flush_buses(bus)
    assert await other.request("double", b"ab") == b"abab"
    assert await bus.request("double", b"") == b""
    answers = await asyncio.gather(*(other.request("double", b"%d" % number) for number in range(50)))
    assert answers == [b"%d" % number * 2 for number in range(50)]
    subscription.unsubscribe()
    await flush_buses(bus)
    with pytest.raises(NoResponse):
        await other.request("double", b"ab")


async def test_slow_response_does_not_delay_others(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    may_respond = asyncio.Event()

    async def respond_later(data: bytes) -> bytes:
        if data == b"slow":
            await may_respond.wait()
        return data

    bus.serve("delayed", respond_later)
    await flush_buses(bus)
    slow = asyncio.create_task(other.request("delayed", b"slow", 20))
    assert await other.request("delayed", b"quick") == b"quick"
    assert not slow.done()
    may_respond.set()
    assert await slow == b"slow"


async def test_request_without_a_response_times_out(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses

    async def never_respond(_: bytes) -> bytes:
        await asyncio.Event().wait()
        return b""

    bus.serve("silence", never_respond)
    await flush_buses(bus)
    with pytest.raises(NoResponse):
        await other.request("silence", timeout_s=0.05)


async def test_failed_responder_is_reported_at_once(buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture) -> None:
    bus, other = buses

    async def broken(data: bytes) -> bytes:
        raise BackendUnavailable("the catalogue", "it is down") if data else RuntimeError("broken")

    bus.serve("broken", broken)
    await flush_buses(bus)
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with caplog.at_level(logging.CRITICAL, "bunraku.messaging.bus"), pytest.raises(ResponderFailed):
            await other.request("broken", timeout_s=3600)
        with pytest.raises(BackendUnavailable) as raised:
            await other.request("broken", b"1", 3600)
    assert raised.value.backend == "the catalogue"


async def test_missing_responder_is_reported_at_once(buses: tuple[Bus, Bus]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with pytest.raises(NoResponse):
            await buses[1].request("no.responder", timeout_s=3600)


async def test_failing_handler_does_not_affect_others(buses: tuple[Bus, Bus], caplog: pytest.LogCaptureFixture) -> None:
    bus, other = buses
    recorder = MessageRecorder()

    def broken(_: bytes) -> None:
        raise RuntimeError("a broken handler")

    other.subscribe("a", broken)
    other.subscribe("a", recorder)
    await flush_buses(other)
    with caplog.at_level(logging.CRITICAL, "bunraku.messaging.bus"):
        bus.publish("a", b"1")
        bus.publish("a", b"2")
        assert await recorder.wait_for(b"2") == [b"1", b"2"]


@pytest.mark.parametrize("size", [0, 1, 70_000, 1 << 20])
async def test_messages_of_all_sizes_are_delivered_unchanged(buses: tuple[Bus, Bus], size: int) -> None:
    bus, other = buses
    recorder = MessageRecorder()
    other.subscribe("a", recorder)
    await flush_buses(other)
    message = (b"\r\nPUB a 1\r\n\x00\xff" * (size // 8 + 1))[:size]
    bus.publish("a", message)
    assert await recorder.wait_for(message) == [message]


@pytest.mark.parametrize("subject", ["", "a..b", ".a", "a.", "a b", "a\r\nPUB b 0", "a.*", ">", "a\x00b", "a" * 257])
async def test_invalid_subject_is_rejected(buses: tuple[Bus, Bus], subject: str) -> None:
    bus, _ = buses

    async def respond(_: bytes) -> bytes:
        return b""

    assert not is_subject(subject)
    with pytest.raises(NoResponse):
        await bus.request(subject)
    with pytest.raises(ValueError, match="subject"):
        bus.publish(subject, b"")
    with pytest.raises(ValueError, match="subject"):
        bus.subscribe(subject, MessageRecorder())
    with pytest.raises(ValueError, match="subject"):
        bus.serve(subject, respond)
    assert bus.is_connected


async def test_closed_bus_delivers_nothing(buses: tuple[Bus, Bus]) -> None:
    bus, other = buses
    recorder = MessageRecorder()
    bus.subscribe("a", recorder)
    await flush_buses(bus)
    await bus.close()
    other.publish("a", b"1")
    bus.publish("a", b"2")
    await flush_buses(other)
    assert recorder.messages == []
