from __future__ import annotations

import pytest

from bunraku.backing.register import Conflict, MemoryRegister


async def test_who_has_not_seen_the_newest_changes_nothing() -> None:
    register = MemoryRegister()
    first = await register.put("sessions.a", b"1", 0)
    with pytest.raises(Conflict):
        await register.put("sessions.a", b"2", 0)
    second = await register.put("sessions.a", b"2", first)
    assert second > first
    for late in (register.put("sessions.a", b"3", first), register.remove("sessions.a", first)):
        with pytest.raises(Conflict):
            await late
    found = await register.get("sessions.a")
    assert found is not None
    assert (found.value, found.revision) == (b"2", second)
    third = await register.put("sessions.a", b"4")
    await register.remove("sessions.a", third)
    assert await register.get("sessions.a") is None
    await register.remove("sessions.a")
    assert await register.put("sessions.a", b"5", 0) > third


async def test_keys_are_listed_by_their_first_words_in_the_order_they_were_made() -> None:
    register = MemoryRegister()
    for key in ("sessions.b", "replicas.b", "sessions.a", "sessionsc.a"):
        await register.put(key, key.encode())
    await register.put("sessions.b", b"new")
    found = await register.all("sessions")
    assert [(key, one.value) for key, one in found.items()] == [("sessions.b", b"new"), ("sessions.a", b"sessions.a")]
