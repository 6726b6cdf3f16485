"""Catalogue while PostgreSQL is down or suspended, or SQLite is locked."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI

from bunraku.http import problem_details
from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage import catalogue_sql
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import CatalogueEntry
from tests.processes import ServerProcess
from tests.storage.conftest import create_database
from tests.time_limit import HANG_TIMEOUT_S

ENTRY = CatalogueEntry("m1", 1, {"name": "a dance"})


@pytest.fixture
def server(postgres_server: ServerProcess) -> Iterator[ServerProcess]:
    """Return the shared server, and restart it afterwards."""
    yield postgres_server
    postgres_server.stop()
    postgres_server.start()


@pytest.fixture
async def catalogue(server: ServerProcess) -> AsyncIterator[Catalogue]:
    opened = Catalogue(await asyncio.to_thread(create_database, server))
    assert await opened.add_motion(ENTRY)
    yield opened
    await opened.close()


async def assert_unavailable(catalogue: Catalogue) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with pytest.raises(BackendUnavailable, match="catalogue"):
            await catalogue.add_motion(CatalogueEntry("m2", 2, {}))
        with pytest.raises(BackendUnavailable):
            await catalogue.get_motion("m1")
        with pytest.raises(BackendUnavailable):
            await catalogue.list_motions(5)
        with pytest.raises(BackendUnavailable):
            await catalogue.remove_motion("m1")


async def wait_until_available(catalogue: Catalogue) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                assert await catalogue.get_motion("m1") == ENTRY
                break
            except BackendUnavailable:
                await asyncio.sleep(0.05)
    # so does every connection of the pool, however long a slow machine takes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(catalogue_sql, "BACKEND_TIMEOUT_S", HANG_TIMEOUT_S)
        assert await asyncio.gather(*(catalogue.get_motion("m1") for _ in range(20))) == [ENTRY] * 20
        assert await catalogue.add_motion(CatalogueEntry("m3", 3, {}))


async def test_catalogue_recovers_after_a_server_crash(server: ServerProcess, catalogue: Catalogue) -> None:
    await asyncio.gather(*(catalogue.get_motion("m1") for _ in range(10)))
    server.kill()
    await assert_unavailable(catalogue)
    server.start()
    await wait_until_available(catalogue)


async def test_suspended_server_is_unavailable_until_resumed(server: ServerProcess, catalogue: Catalogue) -> None:
    await asyncio.gather(*(catalogue.get_motion("m1") for _ in range(3)))
    server.pause()
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            outcomes = await asyncio.gather(*(catalogue.get_motion("m1") for _ in range(30)), return_exceptions=True)
    finally:
        server.resume()
    assert all(isinstance(error, BackendUnavailable) for error in outcomes)
    await wait_until_available(catalogue)


async def test_catalogue_opens_when_the_server_starts(server: ServerProcess) -> None:
    catalogue = Catalogue(await asyncio.to_thread(create_database, server))
    server.stop()
    await assert_unavailable(catalogue)
    server.start()
    assert await catalogue.add_motion(ENTRY)
    await catalogue.close()


async def test_missing_database_is_named(server: ServerProcess) -> None:
    catalogue = Catalogue(f"postgresql://postgres@127.0.0.1:{server.port}/nowhere")
    with pytest.raises(BackendUnavailable, match="nowhere"):
        await catalogue.get_motion("m1")
    await catalogue.close()


async def test_outage_is_a_503_with_retry_after(server: ServerProcess, catalogue: Catalogue) -> None:
    app = FastAPI()
    problem_details.install_problem_handlers(app)

    @app.get("/")
    async def motions() -> int:
        return len((await catalogue.list_motions(5))[0])

    async with httpx2.AsyncClient(transport=httpx2.ASGITransport(app), base_url="http://stage") as http:
        assert (await http.get("/")).json() == 1
        server.kill()
        response = await http.get("/")
        assert response.status_code == 503
        assert response.headers["retry-after"]
        assert str(server.port) not in response.text
        server.start()
        await wait_until_available(catalogue)
        assert (await http.get("/")).json() == 2


async def test_locked_sqlite_is_unavailable(tmp_path: Path) -> None:
    catalogue = Catalogue(f"sqlite:///{tmp_path}/c.sqlite?timeout=0.05")
    assert await catalogue.add_motion(ENTRY)
    other = sqlite3.connect(tmp_path / "c.sqlite")
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(BackendUnavailable, match="locked"):
        await catalogue.add_motion(CatalogueEntry("m2", 2, {}))
    other.rollback()
    other.close()
    assert await catalogue.add_motion(CatalogueEntry("m2", 2, {}))
    await catalogue.close()
