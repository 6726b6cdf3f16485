"""The catalogue when PostgreSQL is away, stands still, or somebody else writes to SQLite."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI

from bunraku.backing import problems
from bunraku.backing.catalogue import Catalogue, Entry
from bunraku.backing.unavailable import Unavailable
from tests.backing.conftest import database
from tests.processes import Owned

ENTRY = Entry("m1", 1, {"name": "a dance"})


@pytest.fixture
def server(postgres_server: Owned) -> Iterator[Owned]:
    """The server, and it is there again afterwards."""
    yield postgres_server
    postgres_server.stop()
    postgres_server.start()


@pytest.fixture
async def catalogue(server: Owned) -> AsyncIterator[Catalogue]:
    opened = Catalogue(await asyncio.to_thread(database, server))
    assert await opened.add(ENTRY)
    yield opened
    await opened.close()


async def everything_is_unavailable(catalogue: Catalogue) -> None:
    async with asyncio.timeout(30):
        with pytest.raises(Unavailable, match="catalogue"):
            await catalogue.add(Entry("m2", 2, {}))
        with pytest.raises(Unavailable):
            await catalogue.get("m1")
        with pytest.raises(Unavailable):
            await catalogue.page(5)
        with pytest.raises(Unavailable):
            await catalogue.remove("m1")


async def it_heals(catalogue: Catalogue) -> None:
    async with asyncio.timeout(30):
        while True:
            try:
                assert await catalogue.get("m1") == ENTRY
                break
            except Unavailable:
                await asyncio.sleep(0.05)
    # and every connection of the pool does
    assert await asyncio.gather(*(catalogue.get("m1") for _ in range(20))) == [ENTRY] * 20
    assert await catalogue.add(Entry("m3", 3, {}))


async def test_it_works_again_when_a_killed_server_is_back(server: Owned, catalogue: Catalogue) -> None:
    await asyncio.gather(*(catalogue.get("m1") for _ in range(10)))
    server.kill()
    await everything_is_unavailable(catalogue)
    server.start()
    await it_heals(catalogue)


async def test_a_server_that_stands_still_is_not_waited_for(server: Owned, catalogue: Catalogue) -> None:
    await asyncio.gather(*(catalogue.get("m1") for _ in range(3)))
    server.pause()
    try:
        async with asyncio.timeout(30):
            told = await asyncio.gather(*(catalogue.get("m1") for _ in range(30)), return_exceptions=True)
    finally:
        server.resume()
    assert all(isinstance(error, Unavailable) for error in told)
    await it_heals(catalogue)


async def test_it_opens_when_the_server_comes(server: Owned) -> None:
    catalogue = Catalogue(await asyncio.to_thread(database, server))
    server.stop()
    await everything_is_unavailable(catalogue)
    server.start()
    assert await catalogue.add(ENTRY)
    await catalogue.close()


async def test_a_database_that_is_not_there_is_said(server: Owned) -> None:
    catalogue = Catalogue(f"postgresql://postgres@127.0.0.1:{server.port}/nowhere")
    with pytest.raises(Unavailable, match="nowhere"):
        await catalogue.get("m1")
    await catalogue.close()


async def test_over_http_it_is_a_503_that_may_be_tried_again(server: Owned, catalogue: Catalogue) -> None:
    app = FastAPI()
    problems.install(app)

    @app.get("/")
    async def motions() -> int:
        return len((await catalogue.page(5))[0])

    async with httpx2.AsyncClient(transport=httpx2.ASGITransport(app), base_url="http://stage") as http:
        assert (await http.get("/")).json() == 1
        server.kill()
        answer = await http.get("/")
        assert answer.status_code == 503
        assert answer.headers["retry-after"]
        assert str(server.port) not in answer.text
        server.start()
        await it_heals(catalogue)
        assert (await http.get("/")).json() == 2


async def test_sqlite_that_others_write_to_for_long_is_unavailable(tmp_path: Path) -> None:
    catalogue = Catalogue(f"sqlite:///{tmp_path}/c.sqlite?timeout=0.05")
    assert await catalogue.add(ENTRY)
    other = sqlite3.connect(tmp_path / "c.sqlite")
    other.execute("BEGIN EXCLUSIVE")
    with pytest.raises(Unavailable, match="locked"):
        await catalogue.add(Entry("m2", 2, {}))
    other.rollback()
    other.close()
    assert await catalogue.add(Entry("m2", 2, {}))
    await catalogue.close()
