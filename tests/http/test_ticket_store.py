from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.http import ticket_store
from bunraku.http.access_control import Access, Role
from bunraku.http.ticket_store import TICKET_LIFETIME_S, TicketStore, TooManyTickets, pack_access, unpack_access
from bunraku.messaging.bus import MemoryBus
from bunraku.messaging.bus_nats import NatsBus
from tests.processes import nats_url_of, run_jetstream

ACCESS = Access(Role.CONTROL, "aiko", session="s", expires=5, share="x")


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


async def test_a_ticket_is_good_once() -> None:
    kept = TicketStore(MemoryBus())
    ticket = kept.issue(ACCESS)
    assert await kept.redeem(ticket) == ACCESS
    assert await kept.redeem(ticket) is None


async def test_a_ticket_is_good_for_half_a_minute_and_what_has_expired_is_not_kept() -> None:
    clock = Clock()
    kept = TicketStore(MemoryBus(), clock)
    late, in_time = kept.issue(ACCESS), kept.issue(ACCESS)
    clock.now = TICKET_LIFETIME_S - 0.1
    assert await kept.redeem(in_time) == ACCESS
    clock.now = TICKET_LIFETIME_S
    assert await kept.redeem(late) is None
    for _ in range(3):
        kept.issue(ACCESS)
    clock.now += TICKET_LIFETIME_S
    kept.issue(ACCESS)
    assert len(kept._issued) == 1


async def test_only_so_many_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ticket_store, "MAX_TICKETS", 3)
    clock = Clock()
    kept = TicketStore(MemoryBus(), clock)
    for _ in range(3):
        kept.issue(ACCESS)
    with pytest.raises(TooManyTickets):
        kept.issue(ACCESS)
    clock.now = TICKET_LIFETIME_S
    kept.issue(ACCESS)


@given(st.text(max_size=80) | st.text("0123456789abcdef*>.", min_size=48, max_size=48))
def test_no_other_word_is_a_ticket(word: str) -> None:
    async def take() -> Access | None:
        kept = TicketStore(MemoryBus())
        kept.issue(ACCESS)
        return await kept.redeem(word)

    assert asyncio.run(take()) is None


async def test_two_replicas_take_each_other_s_and_of_many_at_once_one_gets_it(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        buses = [NatsBus(nats_url_of(server)) for _ in range(3)]
        try:
            for bus in buses:
                await bus.open()
            here, there, third = map(TicketStore, buses)
            tried = [there, third, here, there, third] * 4
            for _ in range(5):
                ticket = here.issue(ACCESS)
                found = await asyncio.gather(*(one.redeem(ticket) for one in tried))
                assert sorted(map(repr, found)) == sorted([repr(ACCESS), *["None"] * (len(tried) - 1)])
            # one whose replica has gone is good no more
            ticket = here.issue(ACCESS)
            here.close()
            assert await there.redeem(ticket) is None
        finally:
            for bus in buses:
                await bus.close()


def test_an_access_goes_over_the_bus_as_it_is() -> None:
    for access in (ACCESS, Access(Role.ADMIN)):
        assert unpack_access(pack_access(access)) == access
