from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

import pytest

from bunraku.http.access_control import FULL_ACCESS, Access, Role
from bunraku.http.authentication import Authenticator
from bunraku.http.problem_details import ProblemError
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.websocket.subprotocol import UNAUTHORIZED, CloseConnection
from tests.credentials import OTHER_SECRET, SECRET, make_token, sign_token
from tests.processes import nats_url_of, run_jetstream

HOST = Access(Role.CONTROL, "host")


@asynccontextmanager
async def open_test_context(tmp_path: Path, bus: str = "memory:", **given: str) -> AsyncIterator[ServiceContext]:
    settings = Settings(data=tmp_path, bus=bus, **{"secret": SECRET, **given})  # type: ignore[arg-type]
    async with open_context(settings) as backing:
        yield backing


async def rejection_title(gate: Authenticator, token: str) -> str:
    with pytest.raises(ProblemError) as refused:
        await gate.authenticate_token(token)
    assert refused.value.status == 401
    return refused.value.title


async def test_without_a_secret_there_is_nothing_to_ask(tmp_path: Path) -> None:
    async with open_test_context(tmp_path, secret="") as backing:
        assert not backing.authenticator.requires_token
        assert (
            await backing.authenticator.authenticate_token("")
            == await backing.authenticator.authenticate_ticket("")
            == FULL_ACCESS
        )
        with pytest.raises(ProblemError, match="no secret"):
            await backing.authenticator.create_share(FULL_ACCESS, "s", None, 60)


async def test_why_one_is_not_let_in_is_said(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as backing:
        gate = backing.authenticator
        assert (await gate.authenticate_token(make_token(subject="aiko"))).subject == "aiko"
        assert await rejection_title(gate, sign_token(exp=5)) == "Link expired"
        assert await rejection_title(gate, sign_token(OTHER_SECRET)) == "Link not valid"
        with pytest.raises(ProblemError, match="good once"):
            await gate.authenticate_ticket("x" * 48)


async def test_tokens_of_the_secret_before_are_good_while_it_is_named(tmp_path: Path) -> None:
    old = sign_token(OTHER_SECRET)
    async with open_test_context(tmp_path, secret_before=OTHER_SECRET) as backing:
        assert (await backing.authenticator.authenticate_token(old)).role is Role.ADMIN
    async with open_test_context(tmp_path) as backing:
        assert await rejection_title(backing.authenticator, old) == "Link not valid"


async def test_a_link_shows_one_thing_until_it_is_revoked(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as backing:
        gate = backing.authenticator
        share, held = await gate.create_share(HOST, "s1", None, 60)
        access = await gate.authenticate_token(held)
        assert (access.role, access.session, access.share) == (Role.VIEW, "s1", share.id)
        assert await gate.can_view(access, "session", "s1")
        assert not await gate.can_view(access, "session", "s2")
        assert not await gate.can_view(access, "motion", "m")
        ticket = gate.tickets.issue(access)
        assert await gate.revoke_share(share.id)
        assert not await gate.revoke_share(share.id)
        assert await rejection_title(gate, held) == "Link revoked"
        with pytest.raises(ProblemError, match="ended it"):
            await gate.authenticate_ticket(ticket)


async def test_a_ticket_does_not_outlive_its_token(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as backing:
        ticket = backing.authenticator.tickets.issue(Access(Role.VIEW, expires=5))
        with pytest.raises(ProblemError, match="ticket"):
            await backing.authenticator.authenticate_ticket(ticket)


async def test_what_stays_open_ends_with_its_token_and_nothing_is_kept_of_it(tmp_path: Path) -> None:
    now = 1_000.0
    async with open_test_context(tmp_path) as backing:
        gate = Authenticator(backing.settings, Catalogue("sqlite:///nowhere"), backing.bus, lambda: now)
        told: asyncio.Future[CloseConnection] = asyncio.get_running_loop().create_future()
        gate.register_connection(Access(Role.VIEW, expires=1_000), told.set_result)
        assert (await told).code == UNAUTHORIZED
        ended: list[CloseConnection] = []
        gone = gate.register_connection(Access(Role.VIEW, expires=2_000, share="x"), ended.append)
        gone()
        backing.bus.publish("shares.revoked", b"x")
        assert ended == []
        assert not gate._close_callbacks
        gate.register_connection(FULL_ACCESS, ended.append)()
        gate.close()


async def test_what_is_open_at_any_replica_ends_with_its_link_also_when_the_bus_was_away(tmp_path: Path) -> None:
    (tmp_path / "nats").mkdir()
    with run_jetstream(tmp_path / "nats") as server:
        async with AsyncExitStack() as stack:
            here, there = [
                (
                    await stack.enter_async_context(open_test_context(tmp_path / "data", nats_url_of(server)))
                ).authenticator
                for _ in range(2)
            ]
            shares = [(await here.create_share(HOST, "s1", None, 600))[0] for _ in range(2)]
            told: list[asyncio.Future[CloseConnection]] = []
            for share in shares:
                told.append(asyncio.get_running_loop().create_future())
                there.register_connection(Access(Role.VIEW, expires=share.expires, share=share.id), told[-1].set_result)
            async with asyncio.timeout(20):
                await here.revoke_share(shares[0].id)
                assert (await told[0]).title == "Link revoked"
                # what is said while the bus is away is lost; it is looked up when the bus is back
                await asyncio.to_thread(server.kill)
                await here.revoke_share(shares[1].id)
                await asyncio.to_thread(server.start)
                assert (await told[1]).title == "Link revoked"
