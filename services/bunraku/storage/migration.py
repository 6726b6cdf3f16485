"""Migration of a catalogue to the schema version of this code.

Several replicas may start at once: a lock lets one migrate while the others wait. Replicas of the previous version keep
running, so a migration only adds what they can ignore. A new migration is a file in `migrations/versions` with the next
`revision`, and a new `HEAD_REVISION` here.
"""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

from sqlalchemy import Connection, NullPool, inspect, text
from sqlalchemy.ext.asyncio import AsyncConnection

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable
from bunraku.storage.engine import create_engine

HEAD_REVISION = "0005"
"""Schema version of this code."""
UNVERSIONED_REVISION = "0001"
"""Schema version of a catalogue that has the table of motions and no version."""
MIGRATION_TIMEOUT_S = 60.0
"""Time limit for a migration, including the wait for other replicas, in seconds."""
_MIGRATION_LOCK_ID = 0x42756E72616B75
"""Key of the advisory lock in PostgreSQL."""
_SCRIPTS_FOLDER = Path(__file__).parent / "migrations"
# Alembic keeps its state in module globals
_alembic_lock = threading.Lock()


class UnknownSchemaVersion(BackendUnavailable):
    """A catalogue that was migrated by a newer Bunraku."""

    def __init__(self, found: str) -> None:
        super().__init__(
            "the catalogue", f"it has schema version {found}, this Bunraku supports {HEAD_REVISION}: upgrade Bunraku"
        )


def read_schema_version(connection: Connection) -> str | None:
    """Return the schema version of a catalogue, without importing Alembic."""
    if not inspect(connection).has_table("alembic_version"):
        return None
    found: str | None = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
    return found


def migrate(url: str) -> None:
    """Migrate the catalogue at an SQLAlchemy URL with an async driver to `HEAD_REVISION`, if it is older.

    Call it in a thread: it blocks and imports Alembic. Raise `UnknownSchemaVersion` and errors of SQLAlchemy.
    """
    with _alembic_lock:
        asyncio.run(_migrate(url))


async def _migrate(url: str) -> None:
    postgres = url.startswith("postgresql")
    connect_args = (
        {"timeout": BACKEND_TIMEOUT_S, "command_timeout": MIGRATION_TIMEOUT_S}
        if postgres
        else {"timeout": MIGRATION_TIMEOUT_S}
    )
    engine = create_engine(url, poolclass=NullPool, connect_args=connect_args)
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
    """Upgrade SQLite in a transaction that takes the write lock first, so that replicas migrate one at a time."""
    await connection.execution_options(isolation_level="AUTOCOMMIT")
    await connection.exec_driver_sql("BEGIN IMMEDIATE")
    try:
        await connection.run_sync(_upgrade)
    except BaseException:
        await connection.exec_driver_sql("ROLLBACK")
        raise
    await connection.exec_driver_sql("COMMIT")


def _upgrade(connection: Connection) -> None:
    # imported here: it takes a second and is needed once in the life of a catalogue
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS_FOLDER).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    current = read_schema_version(connection)
    known = [script.revision for script in ScriptDirectory.from_config(config).walk_revisions()]
    if current is not None and current not in known:
        raise UnknownSchemaVersion(current)
    if current is None and inspect(connection).has_table("motions"):
        command.stamp(config, UNVERSIONED_REVISION)
    command.upgrade(config, HEAD_REVISION)
