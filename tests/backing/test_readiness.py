"""What a process says of itself, upon a real nats-server and PostgreSQL that go away and come back."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI

from bunraku.backing import problems, readiness
from bunraku.backing.backing import open_backing
from bunraku.backing.readiness import Need, Readiness
from bunraku.backing.settings import Settings
from tests.processes import Owned, jetstream, postgres, url_of

ALL: tuple[Need, ...] = ("bus", "register", "catalogue", "library")


@asynccontextmanager
async def asked(settings: Settings, *needs: Need) -> AsyncIterator[tuple[httpx2.AsyncClient, Readiness]]:
    async with open_backing(settings) as backing:
        app, state = FastAPI(), Readiness(backing, needs)
        problems.install(app)
        readiness.install(app, state)
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            yield http, state


@pytest.fixture(scope="module")
def database() -> Iterator[Owned]:
    with postgres() as owned:
        yield owned


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Owned]:
    with jetstream(tmp_path_factory.mktemp("nats")) as owned:
        yield owned


async def away(http: httpx2.AsyncClient) -> list[str]:
    """What is said to be away."""
    answer = await http.get("/readyz")
    if answer.status_code == 200:
        assert answer.json() == {"status": "ready"}
        return []
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    named: list[str] = answer.json()["away"]
    assert named
    assert all(what in answer.json()["detail"] for what in named)
    return named


async def until(http: httpx2.AsyncClient, wanted: set[str]) -> None:
    async with asyncio.timeout(60):
        while set(await away(http)) != wanted:  # noqa: ASYNC110
            await asyncio.sleep(0.05)


async def test_what_is_away_is_named_and_what_is_back_is_not(tmp_path: Path, database: Owned, broker: Owned) -> None:
    settings = Settings(
        data=tmp_path / "data",
        catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
        library=f"file://{tmp_path}/library",
        bus=url_of(broker),
    )
    async with asked(settings, *ALL) as (http, _):
        assert await away(http) == []
        database.kill()
        assert await away(http) == ["the catalogue"]
        broker.kill()
        await until(http, {"the bus", "the catalogue"})
        assert (await http.get("/livez")).status_code == 200
        database.start()
        broker.start()
        await until(http, set())
        shutil.rmtree(tmp_path / "library")
        assert await away(http) == ["the library"]


async def test_only_what_is_needed_is_asked(tmp_path: Path, database: Owned) -> None:
    database.kill()
    try:
        away_for_good = f"postgresql://postgres@127.0.0.1:{database.port}/postgres"
        async with asked(Settings(data=tmp_path, catalogue=away_for_good), "bus", "library") as (http, _):
            assert await away(http) == []
    finally:
        database.start()


async def test_what_is_still_prepared_is_waited_for(tmp_path: Path) -> None:
    async with asked(Settings(data=tmp_path)) as (http, state):
        state.waiting.add("the demo's stage")
        assert await away(http) == ["the demo's stage"]
        state.waiting.clear()
        assert await away(http) == []
