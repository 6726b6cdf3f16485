from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from bunraku.http.access_control import FULL_ACCESS, Access, Role
from bunraku.http.authentication import Authenticator
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.websocket.subprotocol import UNAUTHORIZED, CloseConnection
from tests.credentials import OTHER_SECRET, SECRET, make_token, sign_token
from tests.processes import nats_url_of, run_jetstream
from tests.time_limit import HANG_TIMEOUT_S

HOST = Access(Role.CONTROL, "host")


@asynccontextmanager
async def open_test_context(tmp_path: Path, bus: str = "memory:", **options: str) -> AsyncIterator[ServiceContext]:
    settings = Settings(data=tmp_path, bus=bus, **{"secret": SECRET, **options})  # type: ignore[arg-type]
    async with open_context(settings) as context:
        yield context


async def rejection_title(authenticator: Authenticator, token: str) -> str:
    with pytest.raises(ProblemError) as raised:
        await authenticator.authenticate_token(token)
    assert raised.value.status == 401
    return raised.value.title


async def test_server_without_secret_grants_full_access(tmp_path: Path) -> None:
    async with open_test_context(tmp_path, secret="") as context:
        assert not context.authenticator.requires_token
        assert (
            await context.authenticator.authenticate_token("")
            == await context.authenticator.authenticate_ticket("")
            == FULL_ACCESS
        )
        with pytest.raises(ProblemError, match="no secret"):
            await context.authenticator.create_share(FULL_ACCESS, "s", None, 60)


async def test_rejection_names_the_reason(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as context:
        authenticator = context.authenticator
        assert (await authenticator.authenticate_token(make_token(subject="aiko"))).subject == "aiko"
        assert await rejection_title(authenticator, sign_token(exp=5)) == "Link expired"
        assert await rejection_title(authenticator, sign_token(OTHER_SECRET)) == "Link not valid"
        with pytest.raises(ProblemError, match="valid once"):
            await authenticator.authenticate_ticket("x" * 48)


async def test_previous_secret_is_valid_while_it_is_configured(tmp_path: Path) -> None:
    old = sign_token(OTHER_SECRET)
    async with open_test_context(tmp_path, secret_before=OTHER_SECRET) as context:
        assert (await context.authenticator.authenticate_token(old)).role is Role.ADMIN
    async with open_test_context(tmp_path) as context:
        assert await rejection_title(context.authenticator, old) == "Link not valid"


async def test_link_grants_one_resource_until_revoked(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as context:
        authenticator = context.authenticator
        share, token = await authenticator.create_share(HOST, "s1", None, 60)
        access = await authenticator.authenticate_token(token)
        assert (access.role, access.session, access.share) == (Role.VIEW, "s1", share.id)
        assert await authenticator.can_view(access, "session", "s1")
        assert not await authenticator.can_view(access, "session", "s2")
        assert not await authenticator.can_view(access, "motion", "m")
        ticket = authenticator.tickets.issue(access)
        assert await authenticator.revocations.revoke(share.id)
        assert not await authenticator.revocations.revoke(share.id)
        assert await rejection_title(authenticator, token) == "Link revoked"
        with pytest.raises(ProblemError, match="was revoked"):
            await authenticator.authenticate_ticket(ticket)


async def test_link_ends_with_the_access_that_created_it_except_for_admins(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as context:
        authenticator = context.authenticator
        soon = int(time.time()) + 3_600
        for role, is_shortened in ((Role.CONTROL, True), (Role.INGEST, True), (Role.ADMIN, False)):
            share, token = await authenticator.create_share(Access(role, "host", expires=soon), None, "m", 86_400)
            assert (share.expires == soon) is is_shortened
            assert (await authenticator.authenticate_token(token)).expires == share.expires
        share, _ = await authenticator.create_share(Access(Role.CONTROL, "host", expires=soon), None, "m", 60)
        assert share.expires < soon


async def test_links_of_one_subject_are_limited(tmp_path: Path) -> None:
    async with open_test_context(tmp_path, quota_links="2") as context:
        authenticator = context.authenticator
        shares = [(await authenticator.create_share(HOST, "s1", None, 600))[0] for _ in range(2)]
        with pytest.raises(ProblemError, match="at most 2 links") as raised:
            await authenticator.create_share(HOST, "s1", None, 600)
        assert (raised.value.status, raised.value.title) == (403, "Quota used up")
        await authenticator.create_share(Access(Role.CONTROL, "another"), "s1", None, 600)
        await authenticator.revocations.revoke(shares[0].id)
        await authenticator.create_share(HOST, "s1", None, 600)


async def test_token_of_a_link_grants_no_more_than_its_row(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as context:
        authenticator = context.authenticator
        share, _ = await authenticator.create_share(HOST, "s1", None, 600)
        claims: dict[str, Any] = {"role": "view", "share": share.id, "session": "s1", "exp": share.expires}
        assert (await authenticator.authenticate_token(sign_token(**claims))).session == "s1"
        overrides: list[dict[str, Any]] = [
            {"session": "s2"},
            {"session": None, "motion": "s1"},
            {"exp": share.expires + 1},
        ]
        for forged in overrides:
            assert await rejection_title(authenticator, sign_token(**{**claims, **forged})) == "Link not valid"
        unknown = {"share": "0" * 18, "exp": int(time.time()) + 20 * 86_400}
        assert await rejection_title(authenticator, sign_token(**{**claims, **unknown})) == "Link revoked"


async def test_ticket_expires_with_its_token(tmp_path: Path) -> None:
    async with open_test_context(tmp_path) as context:
        ticket = context.authenticator.tickets.issue(Access(Role.VIEW, expires=5))
        with pytest.raises(ProblemError, match="ticket"):
            await context.authenticator.authenticate_ticket(ticket)


async def test_connection_is_closed_when_its_access_expires(tmp_path: Path) -> None:
    now = 1_000.0
    async with open_test_context(tmp_path) as context:
        authenticator = Authenticator(context.settings, Catalogue("sqlite:///nowhere"), context.bus, lambda: now)
        reason: asyncio.Future[CloseConnection] = asyncio.get_running_loop().create_future()
        authenticator.register_connection(Access(Role.VIEW, expires=1_000), reason.set_result)
        assert (await reason).code == UNAUTHORIZED
        ended: list[CloseConnection] = []
        unregister = authenticator.register_connection(Access(Role.VIEW, expires=2_000, share="x"), ended.append)
        unregister()
        context.bus.publish("shares.revoked", b"x")
        assert ended == []
        assert not authenticator._close_callbacks
        authenticator.register_connection(FULL_ACCESS, ended.append)()
        authenticator.close()


async def test_revocation_reaches_all_replicas_even_after_a_bus_outage(tmp_path: Path) -> None:
    (tmp_path / "nats").mkdir()
    with run_jetstream(tmp_path / "nats") as server:
        async with AsyncExitStack() as stack:
            first, second = [
                (
                    await stack.enter_async_context(open_test_context(tmp_path / "data", nats_url_of(server)))
                ).authenticator
                for _ in range(2)
            ]
            shares = [(await first.create_share(HOST, "s1", None, 600))[0] for _ in range(2)]
            reasons: list[asyncio.Future[CloseConnection]] = []
            for share in shares:
                reasons.append(asyncio.get_running_loop().create_future())
                second.register_connection(
                    Access(Role.VIEW, expires=share.expires, share=share.id), reasons[-1].set_result
                )
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await first.revocations.revoke(shares[0].id)
                assert (await reasons[0]).title == "Link revoked"
                # a message published during the outage is lost; links are checked after reconnecting
                await asyncio.to_thread(server.kill)
                await first.revocations.revoke(shares[1].id)
                await asyncio.to_thread(server.start)
                assert (await reasons[1]).title == "Link revoked"
