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


async def test_ticket_is_valid_once() -> None:
    store = TicketStore(MemoryBus())
    ticket = store.issue(ACCESS)
    assert await store.redeem(ticket) == ACCESS
    assert await store.redeem(ticket) is None


async def test_ticket_expires_and_is_removed() -> None:
    clock = Clock()
    store = TicketStore(MemoryBus(), clock)
    late, in_time = store.issue(ACCESS), store.issue(ACCESS)
    clock.now = TICKET_LIFETIME_S - 0.1
    assert await store.redeem(in_time) == ACCESS
    clock.now = TICKET_LIFETIME_S
    assert await store.redeem(late) is None
    for _ in range(3):
        store.issue(ACCESS)
    clock.now += TICKET_LIFETIME_S
    store.issue(ACCESS)
    assert len(store._issued) == 1


async def test_number_of_tickets_is_limited_by_subject_and_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ticket_store, "MAX_TICKETS_PER_HOLDER", 3)
    clock = Clock()
    store = TicketStore(MemoryBus(), clock)
    tickets = [store.issue(ACCESS, "192.0.2.1") for _ in range(3)]
    with pytest.raises(TooManyTickets):
        store.issue(ACCESS, "192.0.2.1")
    # another subject, and another viewer with the same link
    store.issue(Access(Role.VIEW, "ben"), "192.0.2.1")
    store.issue(ACCESS, "192.0.2.2")
    # a used ticket does not count
    await store.redeem(tickets[1])
    store.issue(ACCESS, "192.0.2.1")
    with pytest.raises(TooManyTickets):
        store.issue(ACCESS, "192.0.2.1")
    clock.now = TICKET_LIFETIME_S
    store.issue(ACCESS, "192.0.2.1")


async def test_full_store_takes_tickets_from_their_largest_holder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ticket_store, "MAX_TICKETS", 20)
    store = TicketStore(MemoryBus())
    flood = Access(Role.VIEW, "share flood")
    kept = [store.issue(Access(Role.VIEW, name)) for name in ("aiko", "ben")]
    flooding = [store.issue(flood, f"192.0.2.{number % 3}") for number in range(100)]
    kept += [store.issue(Access(Role.VIEW, name)) for name in ("chiyo", "dan")]
    assert len(store._issued) == 20
    assert all([await store.redeem(ticket) for ticket in kept])
    redeemed = [await store.redeem(ticket) is not None for ticket in flooding]
    assert sum(redeemed) == 16
    # the newest stay
    assert all(redeemed[-15:])
    assert not store._issued
    assert not store._keys_by_holder


@given(st.text(max_size=80) | st.text("0123456789abcdef*>.", min_size=48, max_size=48))
def test_unknown_ticket_grants_nothing(text: str) -> None:
    async def take() -> Access | None:
        store = TicketStore(MemoryBus())
        store.issue(ACCESS)
        return await store.redeem(text)

    assert asyncio.run(take()) is None


async def test_any_replica_redeems_a_ticket_exactly_once(tmp_path: Path) -> None:
    with run_jetstream(tmp_path) as server:
        buses = [NatsBus(nats_url_of(server)) for _ in range(3)]
        try:
            for bus in buses:
                await bus.open()
            first, second, third = map(TicketStore, buses)
            stores = [second, third, first, second, third] * 4
            for _ in range(5):
                ticket = first.issue(ACCESS)
                results = await asyncio.gather(*(one.redeem(ticket) for one in stores))
                assert sorted(map(repr, results)) == sorted([repr(ACCESS), *["None"] * (len(stores) - 1)])
            # a ticket of a stopped replica is invalid
            ticket = first.issue(ACCESS)
            first.close()
            assert await second.redeem(ticket) is None
        finally:
            for bus in buses:
                await bus.close()


def test_packed_access_round_trips() -> None:
    for access in (ACCESS, Access(Role.ADMIN)):
        assert unpack_access(pack_access(access)) == access
