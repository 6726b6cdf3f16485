"""Catalogue on a real PostgreSQL server that requires TLS."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import asyncpg
import pytest
import uvloop

from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.engine import create_engine
from bunraku.storage.postgres_url import split_tls_options
from bunraku.storage.record import CatalogueEntry
from tests.certificates import Authority
from tests.processes import ServerProcess, run_postgres
from tests.storage.conftest import create_database


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("authority of the database"))


@pytest.fixture(scope="module")
def tls_server(authority: Authority) -> Iterator[ServerProcess]:
    files = authority.issue("postgres", "localhost")
    with run_postgres(certificate=files.certificate, key=files.key) as server:
        yield server


def address(server: ServerProcess, host: str = "localhost") -> str:
    return f"postgresql://postgres@{host}:{server.port}/postgres"


async def open_error(url: str) -> str:
    with pytest.raises(BackendUnavailable) as raised:
        await SqlCatalogue.open(url)
    return str(raised.value)


async def store_and_read(url: str) -> None:
    """Migrate the catalogue and use it; the migration uses a separate connection."""
    catalogue = await SqlCatalogue.open(url)
    try:
        assert await catalogue.add_motion(CatalogueEntry("m1", 1, {}, "a", 1))
        assert (await catalogue.list_motions(5))[0][0].id == "m1"
        await catalogue.remove_motion("m1")
    finally:
        await catalogue.close()


@pytest.mark.parametrize("run", [asyncio.run, uvloop.run])
def test_catalogue_is_migrated_and_used_over_verified_tls(
    run: object, tls_server: ServerProcess, authority: Authority
) -> None:
    assert callable(run)
    run(store_and_read(f"{address(tls_server)}?sslmode=verify-full&sslrootcert={quote(str(authority.ca))}"))


@pytest.mark.parametrize("query", ["sslmode=require", "ssl=require", "sslmode=verify-ca&sslrootcert={ca}", ""])
async def test_other_modes_of_libpq_are_encrypted(query: str, tls_server: ServerProcess, authority: Authority) -> None:
    # the server accepts only TLS; without sslmode it is used if it is offered
    query = query.format(ca=quote(str(authority.ca)))
    await store_and_read(f"{address(tls_server)}?{query}" if query else address(tls_server))


async def test_invalid_certificate_is_rejected_with_the_remedy(
    tmp_path: Path, tls_server: ServerProcess, authority: Authority
) -> None:
    trusted, other = quote(str(authority.ca)), Authority(tmp_path, "other")
    verified = "?sslmode=verify-full&sslrootcert="
    assert "is for another host" in await open_error(f"{address(tls_server, '127.0.0.1')}{verified}{trusted}")
    assert "not signed by a trusted authority" in await open_error(f"{address(tls_server)}{verified}{other.ca}")
    error = await open_error(f"{address(tls_server)}{verified}{tmp_path}/none.crt")
    assert f"cannot read {tmp_path}/none.crt: No such file" in error


async def test_expired_certificate_is_rejected(authority: Authority) -> None:
    files = authority.issue("expired", "localhost", expired=True)
    with run_postgres(certificate=files.certificate, key=files.key) as server:
        error = await open_error(f"{address(server)}?sslmode=verify-full&sslrootcert={quote(str(authority.ca))}")
    assert "the certificate of localhost has expired: renew it" in error


async def test_server_without_tls_is_reported(postgres_server: ServerProcess, authority: Authority) -> None:
    url = await asyncio.to_thread(create_database, postgres_server)
    await store_and_read(url)
    for query in ("sslmode=require", f"sslmode=verify-full&sslrootcert={quote(str(authority.ca))}"):
        assert "127.0.0.1 does not offer TLS: set ssl = on" in await open_error(f"{url}?{query}")


async def test_plain_connection_is_refused_by_the_tls_server(tls_server: ServerProcess) -> None:
    with pytest.raises(asyncpg.InvalidAuthorizationSpecificationError):
        await asyncpg.connect(host="localhost", port=tls_server.port, user="postgres", ssl="disable")


async def test_connection_is_encrypted(tls_server: ServerProcess, authority: Authority) -> None:
    query = f"?sslmode=verify-full&sslrootcert={quote(str(authority.ca))}"
    engine = create_engine(f"{address(tls_server)}{query}".replace("postgresql:", "postgresql+asyncpg:"))
    try:
        async with engine.connect() as connection:
            statement = "SELECT version FROM pg_stat_ssl WHERE pid = pg_backend_pid()"
            assert (await connection.exec_driver_sql(statement)).scalar() in ("TLSv1.2", "TLSv1.3")
    finally:
        await engine.dispose()


def test_tls_options_are_separated_from_the_url() -> None:
    url = "postgresql://me:w%40rd@a:1/b?sslmode=verify-full&sslrootcert=/a%20b/c+d.crt&statement_cache_size=0"
    split = split_tls_options(url)
    assert split.base == "postgresql://me:w%40rd@a:1/b?statement_cache_size=0"
    assert split.tls_dsn == "postgresql://?sslmode=verify-full&sslrootcert=%2Fa+b%2Fc%2Bd.crt"
    assert split.files == ("/a b/c+d.crt",)
    assert split_tls_options("postgresql://a/b") == ("postgresql://a/b", "", ())


def test_unknown_tls_mode_is_rejected_at_the_start() -> None:
    with pytest.raises(ValueError, match="expected disable, allow, prefer, require, verify-ca, verify-full"):
        Catalogue("postgresql://me:word@a/b?sslmode=verify_full")
