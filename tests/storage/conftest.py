"""Databases for new catalogues, in SQLite and on a PostgreSQL server shared by the tests of one process."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Iterator
from pathlib import Path

import asyncpg
import pytest

from bunraku.storage import catalogue_sql
from tests.processes import ServerProcess, run_postgres
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[ServerProcess]:
    """Return a running PostgreSQL server."""
    with run_postgres() as server:
        yield server


async def _create_database(port: int, name: str) -> None:
    connection = await asyncpg.connect(host="127.0.0.1", port=port, user="postgres", database="postgres")
    await connection.execute(f"CREATE DATABASE {name}")
    await connection.close()


def create_database(server: ServerProcess) -> str:
    """Create an empty database and return its URL."""
    name = f"c{secrets.token_hex(6)}"
    asyncio.run(_create_database(server.port, name))
    return f"postgresql://postgres@127.0.0.1:{server.port}/{name}"


@pytest.fixture
def postgres_url(postgres_server: ServerProcess, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the URL of a new, empty PostgreSQL database, for whose answers catalogues wait on a slow machine too."""
    monkeypatch.setattr(catalogue_sql, "BACKEND_TIMEOUT_S", HANG_TIMEOUT_S)
    return create_database(postgres_server)


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Return the URL of a catalogue that does not exist yet."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path}/catalogue.sqlite"
    url: str = request.getfixturevalue("postgres_url")
    return url
