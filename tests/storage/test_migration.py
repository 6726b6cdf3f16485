"""Versions of catalogues, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect, text
from sqlalchemy.ext.asyncio import create_async_engine

from bunraku.storage import migration
from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.migration import HEAD_REVISION, UnknownSchemaVersion, read_schema_version
from bunraku.storage.record import CatalogueEntry
from bunraku.storage.table import METADATA
from tests.conftest import REPOSITORY


async def run_in_connection(url: str, do: Any) -> Any:
    """What a function of a connection gives, in the database at a catalogue's address."""
    driver = url.replace("sqlite:", "sqlite+aiosqlite:").replace("postgresql:", "postgresql+asyncpg:")
    engine = create_async_engine(driver)
    try:
        async with engine.begin() as connection:
            return await connection.run_sync(do)
    finally:
        await engine.dispose()


def test_the_last_migration_is_the_version_of_this_code() -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(migration.__file__).parent / "migrations"))
    config.set_main_option("path_separator", "os")
    assert ScriptDirectory.from_config(config).get_current_head() == HEAD_REVISION


async def test_a_new_catalogue_has_the_tables_that_the_statements_are_for(url: str) -> None:
    await (await SqlCatalogue.open(url)).close()

    def differences(connection: Connection) -> list[Any]:
        return list(compare_metadata(MigrationContext.configure(connection), METADATA))

    assert await run_in_connection(url, differences) == []
    assert await run_in_connection(url, read_schema_version) == HEAD_REVISION


async def test_a_catalogue_from_before_versions_is_taken_over_as_it_is(url: str) -> None:
    def before(connection: Connection) -> None:
        connection.execute(text("CREATE TABLE motions (id VARCHAR(32) PRIMARY KEY, created BIGINT, description TEXT)"))
        connection.execute(text("CREATE INDEX ix_motions_created ON motions (created)"))
        connection.execute(text("INSERT INTO motions VALUES ('m1', 5, '{\"a\": 1}')"))

    await run_in_connection(url, before)
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.get_motion("m1") == CatalogueEntry("m1", 5, {"a": 1})
    await catalogue.close()
    assert await run_in_connection(url, read_schema_version) == HEAD_REVISION


async def test_a_newer_catalogue_is_left_alone_and_said_to_be_so(url: str) -> None:
    await (await SqlCatalogue.open(url)).close()
    await run_in_connection(
        url, lambda connection: connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    )
    with pytest.raises(UnknownSchemaVersion, match="9999"):
        await SqlCatalogue.open(url)
    assert await run_in_connection(url, read_schema_version) == "9999"


async def test_a_migration_that_fails_leaves_nothing_behind(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Trouble(Exception):
        pass

    upgrade = migration._upgrade

    def broken(connection: Connection) -> None:
        upgrade(connection)
        raise Trouble

    monkeypatch.setattr(migration, "_upgrade", broken)
    with pytest.raises(Trouble):
        await SqlCatalogue.open(url)
    assert await run_in_connection(url, lambda connection: inspect(connection).get_table_names()) == []
    monkeypatch.undo()
    await (await SqlCatalogue.open(url)).close()


async def test_ten_replicas_open_a_new_catalogue_at_once(url: str) -> None:
    told = await asyncio.to_thread(
        subprocess.run,
        [sys.executable, "-m", "tests.storage.replicas", url, "10"],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
        timeout=100,
    )
    assert told.stdout.splitlines() == ["OK"] * 10, told.stderr
    catalogue = await SqlCatalogue.open(url)
    assert len((await catalogue.list_motions(20))[0]) == 10
    await catalogue.close()


def test_a_catalogue_that_is_up_to_date_opens_without_alembic(tmp_path: Path) -> None:
    code = f"""
import asyncio, sys
from bunraku.storage.catalogue_sql import SqlCatalogue

async def opened():
    await (await SqlCatalogue.open("sqlite:///{tmp_path}/c.sqlite")).close()

asyncio.run(opened())
print("alembic" in sys.modules, "asyncpg" in sys.modules)
"""
    for alembic in (True, False):
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=REPOSITORY, check=True)
        assert (told.stdout, told.stderr) == (f"{alembic} False\n", "")
