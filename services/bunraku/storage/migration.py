"""Brings a catalogue to the version that this code is written for, whichever of several replicas comes first.

A migration adds what the replicas that still run can do without: they go on while others already have the new version.
A new one is a file in `migrations/versions` with the next `revision`, and `HEAD` here.
"""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

from sqlalchemy import Connection, NullPool, inspect, text
from sqlalchemy.ext.asyncio import AsyncConnection, create_async_engine

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable

HEAD_REVISION = "0003"
"""The version that this code is written for."""
UNVERSIONED_REVISION = "0001"
"""The version of a catalogue that has the table of motions and says none."""
MIGRATION_TIMEOUT_S = 60.0
"""Seconds for a migration, and for those of others before it."""
_MIGRATION_LOCK_ID = 0x42756E72616B75
"""The name of PostgreSQL's advisory lock."""
_SCRIPTS_FOLDER = Path(__file__).parent / "migrations"
# Alembic keeps what it is about in a module
_alembic_lock = threading.Lock()


class UnknownSchemaVersion(BackendUnavailable):
    """The catalogue was last used by a Bunraku that is newer than this one."""

    def __init__(self, found: str) -> None:
        super().__init__(
            "the catalogue", f"it has version {found}, and this Bunraku knows {HEAD_REVISION}: run a newer one"
        )


def read_schema_version(connection: Connection) -> str | None:
    """The version that a catalogue says it has. Loads nothing that migrating needs."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found: str | None = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return found


def migrate(url: str) -> None:
    """Bring the catalogue at an SQLAlchemy URL of an async driver to `HEAD`; nothing happens where it is there already.

    Blocks, and loads Alembic: to be called in a thread. Raises `UnknownVersion`, and what SQLAlchemy raises.
    """
    with _alembic_lock:
        asyncio.run(_migrate(url))


async def _migrate(url: str) -> None:
    postgres = url.startswith("postgresql")
    patience = (
        {"timeout": BACKEND_TIMEOUT_S, "command_timeout": MIGRATION_TIMEOUT_S}
        if postgres
        else {"timeout": MIGRATION_TIMEOUT_S}
    )
    engine = create_async_engine(url, poolclass=NullPool, connect_args=patience)
    try:
        async with engine.connect() as connection:
            if postgres:
                await connection.execute(text(f"SELECT pg_advisory_xact_lock({_MIGRATION_LOCK_ID})"))
                await connection.run_sync(_upgrade)
                await connection.commit()
            else:
                await _upgrade_sqlite(connection)
    finally:
        await engine.dispose()


async def _upgrade_sqlite(connection: AsyncConnection) -> None:
    """Upgrade SQLite in a transaction that writes from its beginning, so that there is one at a time."""
    await connection.execution_options(isolation_level="AUTOCOMMIT")
    await connection.exec_driver_sql("BEGIN IMMEDIATE")
    try:
        await connection.run_sync(_upgrade)
    except BaseException:
        await connection.exec_driver_sql("ROLLBACK")
        raise
    await connection.exec_driver_sql("COMMIT")


def _upgrade(connection: Connection) -> None:
    # imported here, as it takes a second and is wanted once in a catalogue's life
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS_FOLDER).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    at = read_schema_version(connection)
    known = [script.revision for script in ScriptDirectory.from_config(config).walk_revisions()]
    if at is not None and at not in known:
        raise UnknownSchemaVersion(at)
    if at is None and inspect(connection).has_table("motions"):
        command.stamp(config, UNVERSIONED_REVISION)
    command.upgrade(config, HEAD_REVISION)
