from __future__ import annotations

import asyncio

import pytest

from bunraku.backing.bus import MemoryBus, NobodyAnswers


def test_messages_reach_all_who_listen_in_order_until_they_end() -> None:
    bus = MemoryBus()
    first: list[bytes] = []
    second: list[bytes] = []
    one, two = bus.subscribe("a.b", first.append), bus.subscribe("a.b", second.append)
    bus.publish("a.b", b"1")
    bus.publish("a.c", b"elsewhere")
    one.end()
    one.end()
    bus.publish("a.b", b"2")
    two.end()
    bus.publish("a.b", b"3")
    assert (first, second) == ([b"1"], [b"1", b"2"])


async def test_questions_are_answered() -> None:
    bus = MemoryBus()

    async def twice(data: bytes) -> bytes:
        return data * 2

    answering = bus.answer("double", twice)
    assert await bus.ask("double", b"ab") == b"abab"
    answering.end()
    with pytest.raises(NobodyAnswers):
        await bus.ask("double", b"ab")


async def test_a_question_without_an_answer_ends() -> None:
    bus = MemoryBus()

    async def never(_: bytes) -> bytes:
        await asyncio.Event().wait()
        return b""

    bus.answer("silence", never)
    with pytest.raises(NobodyAnswers):
        await bus.ask("silence", seconds=0.01)


async def test_a_closed_bus_is_silent() -> None:
    bus = MemoryBus()
    heard: list[bytes] = []
    bus.subscribe("a", heard.append)
    await bus.close()
    bus.publish("a", b"1")
    assert heard == []
