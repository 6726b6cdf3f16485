"""Servers that the tests of one process share: a bus, and places for new catalogues in SQLite and in PostgreSQL."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Iterator
from pathlib import Path

import asyncpg
import pytest

from tests.processes import ServerProcess, nats_url_of, run_jetstream, run_postgres


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[ServerProcess]:
    """A server that the tests of one process share."""
    with run_postgres() as server:
        yield server


@pytest.fixture(scope="session")
def nats_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a nats-server with JetStream."""
    with run_jetstream(tmp_path_factory.mktemp("nats")) as server:
        yield nats_url_of(server)


async def _create_database(port: int, name: str) -> None:
    connection = await asyncpg.connect(host="127.0.0.1", port=port, user="postgres", database="postgres")
    await connection.execute(f"CREATE DATABASE {name}")
    await connection.close()


def create_database(server: ServerProcess) -> str:
    """The address of a new, empty database."""
    name = f"c{secrets.token_hex(6)}"
    asyncio.run(_create_database(server.port, name))
    return f"postgresql://postgres@127.0.0.1:{server.port}/{name}"


@pytest.fixture
def postgres_url(postgres_server: ServerProcess) -> str:
    """The address of a new, empty database in PostgreSQL."""
    return create_database(postgres_server)


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of a catalogue that is not there yet."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path}/catalogue.sqlite"
    found: str = request.getfixturevalue("postgres_url")
    return found
