"""Readiness during outages of a real nats-server and PostgreSQL."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI

from bunraku.http import problem_details
from bunraku.runtime import readiness
from bunraku.runtime.context import open_context
from bunraku.runtime.readiness import Dependency, Readiness
from bunraku.runtime.settings import Settings
from tests.processes import ServerProcess, nats_url_of, run_jetstream, run_postgres
from tests.time_limit import HANG_TIMEOUT_S

ALL: tuple[Dependency, ...] = ("bus", "register", "catalogue", "library")


@asynccontextmanager
async def open_client(
    settings: Settings, *dependencies: Dependency
) -> AsyncIterator[tuple[httpx2.AsyncClient, Readiness]]:
    async with open_context(settings) as context:
        app, state = FastAPI(), Readiness(context, dependencies)
        problem_details.install_problem_handlers(app)
        readiness.install_health_routes(app, state)
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            yield http, state


@pytest.fixture(scope="module")
def database() -> Iterator[ServerProcess]:
    with run_postgres() as process:
        yield process


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    with run_jetstream(tmp_path_factory.mktemp("nats")) as process:
        yield process


async def list_unavailable(http: httpx2.AsyncClient) -> list[str]:
    """Return the unavailable dependencies."""
    response = await http.get("/readyz")
    if response.status_code == 200:
        assert response.json() == {"status": "ready"}
        return []
    assert response.status_code == 503
    assert response.headers["content-type"] == "application/problem+json"
    unavailable: list[str] = response.json()["away"]
    assert unavailable
    assert all(name in response.json()["detail"] for name in unavailable)
    return unavailable


async def wait_until_unavailable(http: httpx2.AsyncClient, expected: set[str]) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while set(await list_unavailable(http)) != expected:  # noqa: ASYNC110
            await asyncio.sleep(0.05)


async def test_readyz_names_unavailable_backends_until_they_recover(
    tmp_path: Path, database: ServerProcess, broker: ServerProcess
) -> None:
    settings = Settings(
        data=tmp_path / "data",
        catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
        library=f"file://{tmp_path}/library",
        bus=nats_url_of(broker),
    )
    async with open_client(settings, *ALL) as (http, _):
        assert await list_unavailable(http) == []
        database.kill()
        assert await list_unavailable(http) == ["the catalogue"]
        broker.kill()
        await wait_until_unavailable(http, {"the bus", "the catalogue"})
        assert (await http.get("/livez")).status_code == 200
        database.start()
        broker.start()
        await wait_until_unavailable(http, set())
        shutil.rmtree(tmp_path / "library")
        assert await list_unavailable(http) == ["the library"]


async def test_only_dependencies_are_checked(tmp_path: Path, database: ServerProcess) -> None:
    database.kill()
    try:
        unavailable_url = f"postgresql://postgres@127.0.0.1:{database.port}/postgres"
        async with open_client(Settings(data=tmp_path, catalogue=unavailable_url), "bus", "library") as (http, _):
            assert await list_unavailable(http) == []
    finally:
        database.start()


async def test_pending_preparation_is_not_ready(tmp_path: Path) -> None:
    async with open_client(Settings(data=tmp_path)) as (http, state):
        state.pending_preparations.add("the demo's stage")
        assert await list_unavailable(http) == ["the demo's stage"]
        state.pending_preparations.clear()
        assert await list_unavailable(http) == []
