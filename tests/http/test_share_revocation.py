"""Revocation of links that the catalogue cannot store."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import httpx2
import pytest

from bunraku.http import share_revocation
from bunraku.http.access_control import Access, Role
from bunraku.http.authentication import Authenticator
from bunraku.http.share_revocation import SHARE_REVOKED_SUBJECT
from bunraku.messaging.bus import MemoryBus
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import ShareScope
from bunraku.websocket.subprotocol import CloseConnection
from tests.credentials import SECRET, bearer_headers, make_token
from tests.disks import fill_disk, mount_small_disk
from tests.processes import ServerProcess, run_postgres
from tests.servers import run_server
from tests.storage.conftest import create_database
from tests.time_limit import HANG_TIMEOUT_S

HOST = Access(Role.CONTROL, "aiko")


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    with mount_small_disk(tmp_path / "disk", "size=2m") as folder:
        yield folder


@pytest.fixture(autouse=True)
def _short_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(share_revocation, "RETRY_INTERVAL_S", 0.02)


def open_replica(stack: AsyncExitStack, catalogue_url: str, bus: MemoryBus) -> tuple[Authenticator, Catalogue]:
    catalogue = Catalogue(catalogue_url)
    authenticator = Authenticator(Settings(secret=SECRET), catalogue, bus)  # type: ignore[arg-type]
    stack.push_async_callback(catalogue.close)
    stack.callback(authenticator.close)
    return authenticator, catalogue


async def is_revoked(authenticator: Authenticator, token: str) -> bool:
    try:
        await authenticator.authenticate_token(token)
    except ProblemError as error:
        return error.title == "Link revoked"
    return False


async def wait_until_removed(catalogue: Catalogue, share_id: str) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                if await catalogue.get_share(share_id) is None:
                    return
            except BackendUnavailable:
                pass
            await asyncio.sleep(0.02)


async def test_link_is_refused_by_all_replicas_although_its_row_stays(disk: Path) -> None:
    bus, url = MemoryBus(), f"sqlite:///{disk}/c.sqlite"
    async with AsyncExitStack() as stack:
        (first, catalogue), (second, _) = (open_replica(stack, url, bus) for _ in range(2))
        share, token = await first.create_share(HOST, "s1", None, 600)
        closed: list[CloseConnection] = []
        second.register_connection(await second.authenticate_token(token), closed.append)
        (disk / "c.sqlite-reserve").unlink()
        filler = fill_disk(disk)
        with pytest.raises(ProblemError, match="grants nothing from now on") as raised:
            await first.revocations.revoke(share.id)
        assert raised.value.status == 507
        assert await catalogue.get_share(share.id) is not None
        assert [one.title for one in closed] == ["Link revoked"]
        assert await is_revoked(first, token)
        assert await is_revoked(second, token)
        # a replica that starts later receives the revocation, too, also after the first has failed
        first.close()
        late, _ = open_replica(stack, url, bus)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not await is_revoked(late, token):  # noqa: ASYNC110
                await asyncio.sleep(0.02)
        await asyncio.to_thread(filler.unlink)
        await wait_until_removed(catalogue, share.id)
        assert await is_revoked(open_replica(stack, url, MemoryBus())[0], token)


async def test_connection_authenticated_before_the_revocation_is_closed(tmp_path: Path) -> None:
    async with AsyncExitStack() as stack:
        authenticator, _ = open_replica(stack, f"sqlite:///{tmp_path}/c.sqlite", MemoryBus())
        share, token = await authenticator.create_share(HOST, "s1", None, 600)
        access = await authenticator.authenticate_token(token)
        assert await authenticator.revocations.revoke(share.id)
        closed: list[CloseConnection] = []
        authenticator.register_connection(access, closed.append)
        assert [one.title for one in closed] == ["Link revoked"]


async def test_memory_of_revocations_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MAX_PENDING_REVOCATIONS", "MAX_UNVERIFIED_REVOCATIONS", "MAX_REMEMBERED_REVOCATIONS"):
        monkeypatch.setattr(share_revocation, name, 5)
    bus = MemoryBus()
    async with AsyncExitStack() as stack:
        revocations = open_replica(stack, f"sqlite:///{tmp_path}/c.sqlite", bus)[0].revocations
        for number in range(50):
            bus.publish(SHARE_REVOKED_SUBJECT, f"{number:018x}".encode())
            revocations.revoke_unverified(f"{number:018x}", ShareScope(), BackendUnavailable("the catalogue", "test"))
        bus.publish(SHARE_REVOKED_SUBJECT, b"no id")
        assert len(revocations._pending) == len(revocations._remembered) == len(revocations._unverified) == 5
        assert revocations.is_refused(f"{49:018x}")


@pytest.mark.parametrize("full_at_start", [False, True])
def test_revocation_on_a_full_disk_over_http(disk: Path, tmp_path: Path, full_at_start: bool) -> None:
    options: dict[str, Any] = {"secret": SECRET, "library": f"file://{tmp_path}/library"}
    with run_server(disk / "data", **options) as url, httpx2.Client(base_url=url) as http:
        host = bearer_headers(make_token())
        session = {"session": "none"}
        assert http.post("/v1/shares", headers=host, json=session).status_code == 404
    catalogue = Catalogue(f"sqlite:///{disk}/data/catalogue.sqlite")

    async def add() -> tuple[str, str]:
        authenticator = Authenticator(Settings(secret=SECRET), catalogue, MemoryBus())  # type: ignore[arg-type]
        share, token = await authenticator.create_share(HOST, "s1", None, 600)
        authenticator.close()
        await catalogue.close()
        return share.id, token

    share_id, token = asyncio.run(add())
    if full_at_start:
        (disk / "data" / "catalogue.sqlite-reserve").unlink()
        fill_disk(disk)
    with run_server(disk / "data", **options) as url, httpx2.Client(base_url=url) as http:
        if not full_at_start:
            assert http.get("/v1/motions", headers=bearer_headers(token)).status_code == 200
            fill_disk(disk)
        response = http.delete(f"/v1/shares/{share_id}", headers=host)
        assert response.status_code == (507 if full_at_start else 204)
        assert http.get("/v1/motions", headers=bearer_headers(token)).status_code == 401


@pytest.fixture
def postgres() -> Iterator[ServerProcess]:
    with run_postgres() as server:
        yield server


async def test_revocation_during_an_outage_takes_effect_after_it(postgres: ServerProcess) -> None:
    url = await asyncio.to_thread(create_database, postgres)
    async with AsyncExitStack() as stack:
        authenticator, catalogue = open_replica(stack, url, MemoryBus())
        shares = [(await authenticator.create_share(HOST, "s1", None, 600)) for _ in range(3)]
        closed: list[CloseConnection] = []
        authenticator.register_connection(await authenticator.authenticate_token(shares[0][1]), closed.append)
        await asyncio.to_thread(postgres.kill)
        outage = BackendUnavailable("the catalogue", "test")
        for (share, _), subject in zip(shares, ("aiko", "another", None), strict=True):
            assert authenticator.revocations.revoke_unverified(share.id, ShareScope(subject), outage).status == 503
        with pytest.raises(BackendUnavailable):
            await authenticator.authenticate_token(shares[1][1])
        await asyncio.to_thread(postgres.start)
        await wait_until_removed(catalogue, shares[0][0].id)
        await wait_until_removed(catalogue, shares[2][0].id)
        assert [one.title for one in closed] == ["Link revoked"]
        assert await is_revoked(authenticator, shares[2][1])
        # only the subject that created a link may revoke it
        assert not await is_revoked(authenticator, shares[1][1])
