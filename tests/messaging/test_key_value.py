"""What holds of every register: within one process, and over a real nats-server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from bunraku.messaging.bus_nats import NatsBus
from bunraku.messaging.key_value import KeyValueStore, MemoryKeyValueStore, RevisionConflict
from bunraku.messaging.key_value_nats import NatsKeyValueStore


@pytest.fixture(params=["memory", "nats"])
async def registers(request: pytest.FixtureRequest) -> AsyncIterator[tuple[KeyValueStore, KeyValueStore]]:
    """The register as two replicas see it."""
    if request.param == "memory":
        register = MemoryKeyValueStore()
        yield register, register
        return
    url = request.getfixturevalue("nats_url")
    buses = NatsBus(url), NatsBus(url)
    for bus in buses:
        await bus.open()
    one, two = map(NatsKeyValueStore, buses)
    yield one, two
    for prefix in ("sessions", "replicas", "sessionsc"):
        for key in await one.list_prefix(prefix):
            await one.remove(key)
    for bus in buses:
        await bus.close()


async def test_who_has_not_seen_the_newest_changes_nothing(registers: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = registers
    assert await one.get("sessions.a") is None
    first = await one.put("sessions.a", b"1", 0)
    with pytest.raises(RevisionConflict):
        await two.put("sessions.a", b"2", 0)
    second = await two.put("sessions.a", b"2", first)
    assert second > first
    for late in (one.put("sessions.a", b"3", first), one.remove("sessions.a", first)):
        with pytest.raises(RevisionConflict):
            await late
    found = await one.get("sessions.a")
    assert found is not None
    assert (found.value, found.revision) == (b"2", second)
    third = await two.put("sessions.a", b"4")
    await one.remove("sessions.a", third)
    assert await two.get("sessions.a") is None
    await one.remove("sessions.a")
    assert await two.put("sessions.a", b"", 0) > third
    empty = await one.get("sessions.a")
    assert empty is not None
    assert empty.value == b""


async def test_keys_are_found_by_their_first_words(registers: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = registers
    assert await two.list_prefix("sessions") == {}
    for key in ("sessions.b-_1", "replicas.b", "sessions.a", "sessions.gone", "sessionsc.a"):
        await one.put(key, key.encode())
    await two.put("sessions.b-_1", b"new")
    await one.remove("sessions.gone")
    found = await two.list_prefix("sessions")
    assert {key: registered.value for key, registered in found.items()} == {
        "sessions.b-_1": b"new",
        "sessions.a": b"sessions.a",
    }
    assert found["sessions.a"] == await one.get("sessions.a")


async def test_of_many_who_want_a_key_one_has_it(registers: tuple[KeyValueStore, KeyValueStore]) -> None:
    one, two = registers
    revision = await one.put("sessions.a", b"nobody")
    tried = await asyncio.gather(
        *(register.put("sessions.a", b"x", revision) for register in (one, two) * 10), return_exceptions=True
    )
    assert sum(isinstance(outcome, int) for outcome in tried) == 1
    assert sum(isinstance(outcome, RevisionConflict) for outcome in tried) == 19
