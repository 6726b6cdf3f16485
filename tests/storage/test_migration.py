"""Schema versions of catalogues, on SQLite and PostgreSQL."""

from __future__ import annotations

import asyncio
import json
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
from tests.time_limit import HANG_TIMEOUT_S


async def run_in_connection(url: str, function: Any) -> Any:
    """Call a function with a connection to the database of a catalogue."""
    driver = url.replace("sqlite:", "sqlite+aiosqlite:").replace("postgresql:", "postgresql+asyncpg:")
    engine = create_async_engine(driver)
    try:
        async with engine.begin() as connection:
            return await connection.run_sync(function)
    finally:
        await engine.dispose()


def test_head_revision_is_the_last_migration() -> None:
    config = Config()
    config.set_main_option("script_location", str(Path(migration.__file__).parent / "migrations"))
    config.set_main_option("path_separator", "os")
    assert ScriptDirectory.from_config(config).get_current_head() == HEAD_REVISION


async def test_migrated_schema_equals_the_declared_tables(url: str) -> None:
    await (await SqlCatalogue.open(url)).close()

    def differences(connection: Connection) -> list[Any]:
        return list(compare_metadata(MigrationContext.configure(connection), METADATA))

    assert await run_in_connection(url, differences) == []
    assert await run_in_connection(url, read_schema_version) == HEAD_REVISION


async def test_unversioned_catalogue_is_migrated_with_its_rows(url: str) -> None:
    def create_unversioned(connection: Connection) -> None:
        connection.execute(text("CREATE TABLE motions (id VARCHAR(32) PRIMARY KEY, created BIGINT, description TEXT)"))
        connection.execute(text("CREATE INDEX ix_motions_created ON motions (created)"))
        connection.execute(text("INSERT INTO motions VALUES ('m1', 5, '{\"a\": 1}')"))

    await run_in_connection(url, create_unversioned)
    catalogue = await SqlCatalogue.open(url)
    assert await catalogue.get_motion("m1") == CatalogueEntry("m1", 5, {"a": 1})
    await catalogue.close()
    assert await run_in_connection(url, read_schema_version) == HEAD_REVISION


async def test_search_columns_of_old_rows_are_filled(url: str) -> None:
    count = 1_203

    def create_unversioned(connection: Connection) -> None:
        connection.execute(text("CREATE TABLE motions (id VARCHAR(32) PRIMARY KEY, created BIGINT, description TEXT)"))
        connection.execute(text("CREATE INDEX ix_motions_created ON motions (created)"))
        rows = [
            {"id": f"m{number}", "created": number, "description": json.dumps({"name": f"Ärmel {number}"})}
            for number in range(count)
        ]
        rows += [
            {"id": "x1", "created": 1, "description": '{"name": "\\ud800\\u0000Z", "tags": ["Q"]}'},
            {"id": "x2", "created": 1, "description": '{"name": null}'},
        ]
        connection.execute(text("INSERT INTO motions VALUES (:id, :created, :description)"), rows)

    def read_columns(connection: Connection) -> dict[str, tuple[str, str]]:
        rows = connection.execute(text("SELECT id, folded_name, folded_tags FROM motions"))
        return {row.id: (row.folded_name, row.folded_tags) for row in rows}

    await run_in_connection(url, create_unversioned)
    catalogue = await SqlCatalogue.open(url)
    await catalogue.close()
    columns = await run_in_connection(url, read_columns)
    assert len(columns) == count + 2
    assert all(columns[f"m{number}"] == (f"ärmel {number}", "") for number in range(count))
    assert (columns["x1"], columns["x2"]) == (("z", "\nq\n"), ("", ""))


async def test_newer_catalogue_is_rejected_and_unchanged(url: str) -> None:
    await (await SqlCatalogue.open(url)).close()
    await run_in_connection(
        url, lambda connection: connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    )
    with pytest.raises(UnknownSchemaVersion, match="9999"):
        await SqlCatalogue.open(url)
    assert await run_in_connection(url, read_schema_version) == "9999"


async def test_failed_migration_is_rolled_back(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
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
    completed = await asyncio.to_thread(
        subprocess.run,
        [sys.executable, "-m", "tests.storage.replicas", url, "10"],
        capture_output=True,
        text=True,
        cwd=REPOSITORY,
        timeout=HANG_TIMEOUT_S,
    )
    assert completed.stdout.splitlines() == ["OK"] * 10, completed.stderr
    catalogue = await SqlCatalogue.open(url)
    assert len((await catalogue.list_motions(20))[0]) == 10
    await catalogue.close()


def test_current_catalogue_opens_without_importing_alembic(tmp_path: Path) -> None:
    code = f"""
import asyncio, sys
from bunraku.storage.catalogue_sql import SqlCatalogue

async def opened():
    await (await SqlCatalogue.open("sqlite:///{tmp_path}/c.sqlite")).close()

asyncio.run(opened())
print("alembic" in sys.modules, "asyncpg" in sys.modules)
"""
    for alembic in (True, False):
        completed = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, cwd=REPOSITORY, check=True
        )
        assert (completed.stdout, completed.stderr) == (f"{alembic} False\n", "")
