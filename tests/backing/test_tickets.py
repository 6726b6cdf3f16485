from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.backing import tickets
from bunraku.backing.access import Access, Role
from bunraku.backing.bus import MemoryBus
from bunraku.backing.bus_nats import NatsBus
from bunraku.backing.tickets import LASTS, Tickets, TooManyTickets, packed, unpacked
from tests.processes import jetstream, url_of

ACCESS = Access(Role.CONTROL, "aiko", session="s", expires=5, share="x")


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


async def test_a_ticket_is_good_once() -> None:
    kept = Tickets(MemoryBus())
    ticket = kept.give(ACCESS)
    assert await kept.take(ticket) == ACCESS
    assert await kept.take(ticket) is None


async def test_a_ticket_is_good_for_half_a_minute_and_what_has_expired_is_not_kept() -> None:
    clock = Clock()
    kept = Tickets(MemoryBus(), clock)
    late, in_time = kept.give(ACCESS), kept.give(ACCESS)
    clock.now = LASTS - 0.1
    assert await kept.take(in_time) == ACCESS
    clock.now = LASTS
    assert await kept.take(late) is None
    for _ in range(3):
        kept.give(ACCESS)
    clock.now += LASTS
    kept.give(ACCESS)
    assert len(kept._kept) == 1


async def test_only_so_many_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tickets, "MOST", 3)
    clock = Clock()
    kept = Tickets(MemoryBus(), clock)
    for _ in range(3):
        kept.give(ACCESS)
    with pytest.raises(TooManyTickets):
        kept.give(ACCESS)
    clock.now = LASTS
    kept.give(ACCESS)


@given(st.text(max_size=80) | st.text("0123456789abcdef*>.", min_size=48, max_size=48))
def test_no_other_word_is_a_ticket(word: str) -> None:
    async def take() -> Access | None:
        kept = Tickets(MemoryBus())
        kept.give(ACCESS)
        return await kept.take(word)

    assert asyncio.run(take()) is None


async def test_two_replicas_take_each_other_s_and_of_many_at_once_one_gets_it(tmp_path: Path) -> None:
    with jetstream(tmp_path) as server:
        buses = [NatsBus(url_of(server)) for _ in range(3)]
        try:
            for bus in buses:
                await bus.open()
            here, there, third = map(Tickets, buses)
            tried = [there, third, here, there, third] * 4
            for _ in range(5):
                ticket = here.give(ACCESS)
                found = await asyncio.gather(*(one.take(ticket) for one in tried))
                assert sorted(map(repr, found)) == sorted([repr(ACCESS), *["None"] * (len(tried) - 1)])
            # one whose replica has gone is good no more
            ticket = here.give(ACCESS)
            here.close()
            assert await there.take(ticket) is None
        finally:
            for bus in buses:
                await bus.close()


def test_an_access_goes_over_the_bus_as_it_is() -> None:
    for access in (ACCESS, Access(Role.ADMIN)):
        assert unpacked(packed(access)) == access
