from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import pytest

from bunraku.backing.access import EVERYTHING, Access, Role
from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.catalogue import Catalogue
from bunraku.backing.gate import Gate
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.backing.sockets import DENIED, Refusal
from tests.guests import OTHER, SECRET, signed, token
from tests.processes import jetstream, url_of

HOST = Access(Role.CONTROL, "host")


@asynccontextmanager
async def opened(tmp_path: Path, bus: str = "memory:", **given: str) -> AsyncIterator[Backing]:
    settings = Settings(data=tmp_path, bus=bus, **{"secret": SECRET, **given})  # type: ignore[arg-type]
    async with open_backing(settings) as backing:
        yield backing


async def why(gate: Gate, held: str) -> str:
    with pytest.raises(ProblemError) as refused:
        await gate.by_token(held)
    assert refused.value.status == 401
    return refused.value.title


async def test_without_a_secret_there_is_nothing_to_ask(tmp_path: Path) -> None:
    async with opened(tmp_path, secret="") as backing:
        assert not backing.gate.closed
        assert await backing.gate.by_token("") == await backing.gate.by_ticket("") == EVERYTHING
        with pytest.raises(ProblemError, match="no secret"):
            await backing.gate.share(EVERYTHING, "s", None, 60)


async def test_why_one_is_not_let_in_is_said(tmp_path: Path) -> None:
    async with opened(tmp_path) as backing:
        gate = backing.gate
        assert (await gate.by_token(token(subject="aiko"))).subject == "aiko"
        assert await why(gate, signed(exp=5)) == "Link expired"
        assert await why(gate, signed(OTHER)) == "Link not valid"
        with pytest.raises(ProblemError, match="good once"):
            await gate.by_ticket("x" * 48)


async def test_tokens_of_the_secret_before_are_good_while_it_is_named(tmp_path: Path) -> None:
    old = signed(OTHER)
    async with opened(tmp_path, secret_before=OTHER) as backing:
        assert (await backing.gate.by_token(old)).role is Role.ADMIN
    async with opened(tmp_path) as backing:
        assert await why(backing.gate, old) == "Link not valid"


async def test_a_link_shows_one_thing_until_it_is_revoked(tmp_path: Path) -> None:
    async with opened(tmp_path) as backing:
        gate = backing.gate
        share, held = await gate.share(HOST, "s1", None, 60)
        access = await gate.by_token(held)
        assert (access.role, access.session, access.share) == (Role.VIEW, "s1", share.id)
        assert await gate.sees(access, "session", "s1")
        assert not await gate.sees(access, "session", "s2")
        assert not await gate.sees(access, "motion", "m")
        ticket = gate.tickets.give(access)
        assert await gate.revoke(share.id)
        assert not await gate.revoke(share.id)
        assert await why(gate, held) == "Link revoked"
        with pytest.raises(ProblemError, match="ended it"):
            await gate.by_ticket(ticket)


async def test_a_ticket_does_not_outlive_its_token(tmp_path: Path) -> None:
    async with opened(tmp_path) as backing:
        ticket = backing.gate.tickets.give(Access(Role.VIEW, expires=5))
        with pytest.raises(ProblemError, match="ticket"):
            await backing.gate.by_ticket(ticket)


async def test_what_stays_open_ends_with_its_token_and_nothing_is_kept_of_it(tmp_path: Path) -> None:
    now = 1_000.0
    async with opened(tmp_path) as backing:
        gate = Gate(backing.settings, Catalogue("sqlite:///nowhere"), backing.bus, lambda: now)
        told: asyncio.Future[Refusal] = asyncio.get_running_loop().create_future()
        gate.stay(Access(Role.VIEW, expires=1_000), told.set_result)
        assert (await told).code == DENIED
        ended: list[Refusal] = []
        gone = gate.stay(Access(Role.VIEW, expires=2_000, share="x"), ended.append)
        gone()
        backing.bus.publish("shares.revoked", b"x")
        assert ended == []
        assert not gate._open
        gate.stay(EVERYTHING, ended.append)()
        gate.close()


async def test_what_is_open_at_any_replica_ends_with_its_link_also_when_the_bus_was_away(tmp_path: Path) -> None:
    (tmp_path / "nats").mkdir()
    with jetstream(tmp_path / "nats") as server:
        async with AsyncExitStack() as stack:
            here, there = [
                (await stack.enter_async_context(opened(tmp_path / "data", url_of(server)))).gate for _ in range(2)
            ]
            shares = [(await here.share(HOST, "s1", None, 600))[0] for _ in range(2)]
            told: list[asyncio.Future[Refusal]] = []
            for share in shares:
                told.append(asyncio.get_running_loop().create_future())
                there.stay(Access(Role.VIEW, expires=share.expires, share=share.id), told[-1].set_result)
            async with asyncio.timeout(20):
                await here.revoke(shares[0].id)
                assert (await told[0]).title == "Link revoked"
                # what is said while the bus is away is lost; it is looked up when the bus is back
                await asyncio.to_thread(server.kill)
                await here.revoke(shares[1].id)
                await asyncio.to_thread(server.start)
                assert (await told[1]).title == "Link revoked"
