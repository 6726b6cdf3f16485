"""Catalogue in SQL: SQLite by default, PostgreSQL by URL, with the same statements on both."""

from __future__ import annotations

import asyncio
import json
import sqlite3
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from sqlalchemy import Column, Row, delete, event, func, select, text, tuple_, update
from sqlalchemy.exc import DBAPIError, IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnection
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendTimeout, BackendUnavailable
from bunraku.runtime.insufficient_storage import insufficient_storage
from bunraku.runtime.problem import ProblemError
from bunraku.storage.cursor import parse_cursor, write_cursor
from bunraku.storage.engine import create_engine
from bunraku.storage.job_sql import SqlJobTable
from bunraku.storage.migration import HEAD_REVISION, migrate, read_schema_version
from bunraku.storage.prop_sql import SqlPropTable
from bunraku.storage.record import CatalogueEntry, MotionFilter, Quota, QuotaExceeded, is_motion_id
from bunraku.storage.search_text import fold_tag, fold_text, search_columns
from bunraku.storage.share_sql import SqlShareTable
from bunraku.storage.space_reserve import SpaceReserve
from bunraku.storage.table import JOBS, MOTIONS

_QUOTA_LOCK_ID = 0x636F756E74
"""Key of the advisory lock in PostgreSQL under which motions are counted and added."""
_DRIVERS = {"sqlite": "sqlite+aiosqlite", "postgresql": "postgresql+asyncpg"}
_CALLER_SQLSTATES = ("22", "23", "42", "53100")
"""Prefixes of SQLSTATEs that are not outages of PostgreSQL: errors of data, constraints and statements; full disk."""
_DISK_FULL_SQLSTATE = "53100"
_SQLITE_SPACE_ERRORS = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_CANTOPEN)
"""Primary result codes of SQLite when a disk or quota is full: besides FULL, those of a journal that cannot be made."""
ALL_MOTIONS = MotionFilter()
_FILL_CHUNK_ROWS = 500
"""Rows without search columns that are filled in one transaction."""
RESERVE_SUFFIX = "-reserve"
"""Suffix of the file of reserved space beside an SQLite database."""

Result = TypeVar("Result")
DescriptionEdit = Callable[[CatalogueEntry], dict[str, Any]]
"""Function that returns the new description of a motion, or raises; it may be called again after another edit."""


class MotionKey(NamedTuple):
    """A row of the motions, without its description."""

    id: str
    created: int
    bytes: int
    """Size of the object; 0 in rows from before quotas."""


class SqlCatalogue:
    """Tables of motions, jobs, viewer links and props.

    Methods raise `BackendUnavailable` while the database is unavailable, on PostgreSQL also if it does not respond
    within `BACKEND_TIMEOUT_S`, and work again when it recovers. If the disk of the database is full, methods that
    change rows raise `ProblemError` (507); on SQLite, rows can still be removed, in space reserved for this purpose.

    A row that was added or removed survives a power loss. PostgreSQL ensures it by default; SQLite needs `EXTRA`, which
    also synchronises the folder after a transaction's journal was removed from it.
    """

    def __init__(self, url: str) -> None:
        """`url` is in SQLAlchemy's form, with an async driver."""
        self._url = url
        self._postgres = url.startswith("postgresql")
        self._timeout = BackendTimeout("the catalogue")
        pool_options: dict[str, Any] = {
            "pool_pre_ping": True,
            "pool_timeout": BACKEND_TIMEOUT_S,
            "connect_args": {"timeout": BACKEND_TIMEOUT_S, "command_timeout": BACKEND_TIMEOUT_S},
        }
        self._engine: AsyncEngine = create_engine(url, **(pool_options if self._postgres else {}))
        self.reserve: SpaceReserve | None = None
        """Reserved space on the disk of an SQLite database."""
        if not self._postgres:
            event.listen(self._engine.sync_engine, "connect", _make_commits_durable)
            if self._engine.url.database:
                database = Path(self._engine.url.database)
                self.reserve = SpaceReserve(database.with_name(database.name + RESERVE_SUFFIX))
        self.jobs = SqlJobTable(self._engine, self._run_query, self._run_removal)
        self.shares = SqlShareTable(self._engine, self._run_query, self._run_removal)
        self.props = SqlPropTable(self._engine, self._run_query, self._run_removal)

    @classmethod
    async def open(cls, url: str) -> SqlCatalogue:
        """Open the catalogue at `sqlite:///path` or `postgresql://...` and migrate it to the version of this code.

        Raise `UnknownSchemaVersion` if a newer Bunraku has migrated it.
        """
        scheme, rest = url.split(":", 1)
        catalogue = cls(f"{_DRIVERS[scheme]}:{rest}")
        try:
            # no time limit beside the driver's: the first imports may take seconds
            if await catalogue._run_query(catalogue._schema_version(), limit_time=False) != HEAD_REVISION:
                await catalogue._run_query(asyncio.to_thread(migrate, catalogue._url), limit_time=False)
        except BaseException:
            await catalogue.close()
            raise
        if catalogue.reserve is not None:
            await asyncio.to_thread(catalogue.reserve.restore)
        return catalogue

    async def close(self) -> None:
        """Close all connections."""
        await self._timeout.drain_abandoned()
        await self._engine.dispose()

    async def add_motion(self, entry: CatalogueEntry, quota: Quota | None = None) -> bool:
        """Add a motion and return whether it is new; raise `QuotaExceeded`, with nothing added, beyond `quota`."""
        return await self._run_query(self._insert_motion(entry, quota))

    async def check_quota(self, subject: str, quota: Quota) -> None:
        """Raise `QuotaExceeded` if `subject` cannot add even a small motion."""
        await self._run_query(self._check_quota(subject, quota))

    async def get_motion(self, motion_id: str) -> CatalogueEntry | None:
        """Return a motion, None if it does not exist."""
        return await self._run_query(self._select_motion(motion_id)) if is_motion_id(motion_id) else None

    async def list_motions(
        self, limit: int, cursor: str | None = None, condition: MotionFilter = ALL_MOTIONS
    ) -> tuple[list[CatalogueEntry], str | None]:
        """Return at most `limit` motions, newest first, and the next page's cursor; raise `InvalidCursor`.

        A cursor is a position in the list of all motions: it stays valid whatever is added, removed or renamed.
        """
        after = parse_cursor(cursor) if cursor is not None else None
        if condition != ALL_MOTIONS:
            while await self._run_query(self._fill_search_columns()):
                pass
        return await self._run_query(self._select_motions(limit, after, condition))

    async def edit_motion(
        self, motion_id: str, edit: DescriptionEdit, object_bytes: int | None = None
    ) -> CatalogueEntry | None:
        """Replace the description of a motion, and the size of its object, and return its entry.

        Return None if it does not exist. Concurrent edits follow one another: none is lost.
        """
        if not is_motion_id(motion_id):
            return None
        return await self._run_query(self._update_description(motion_id, edit, object_bytes))

    async def remove_motion(self, motion_id: str) -> bool:
        """Remove a motion and return whether it existed."""
        return is_motion_id(motion_id) and await self._run_removal(lambda: self._delete_motion(motion_id))

    async def list_motion_keys(self, limit: int, after: str = "") -> list[MotionKey]:
        """Return at most `limit` rows with ids greater than `after`, by id."""
        return await self._run_query(self._select_motion_keys(limit, after))

    async def find_motions(self, ids: list[str]) -> set[str]:
        """Return those of `ids` that are motions."""
        return await self._run_query(self._select_existing(MOTIONS.c.id, ids))

    async def find_jobs(self, ids: list[str]) -> set[str]:
        """Return those of `ids` that are pending jobs."""
        return await self._run_query(self._select_existing(JOBS.c.id, ids))

    async def _insert_motion(self, entry: CatalogueEntry, quota: Quota | None) -> bool:
        row = {
            "id": entry.id,
            "created": entry.created,
            "description": json.dumps(entry.description),
            "subject": entry.subject,
            "bytes": entry.bytes,
            **search_columns(entry.description),
        }
        try:
            async with self._engine.begin() as connection:
                if quota is not None and self._postgres:
                    # SQLite needs no lock: it admits one writer from the insert on
                    await connection.execute(text(f"SELECT pg_advisory_xact_lock({_QUOTA_LOCK_ID})"))
                await connection.execute(MOTIONS.insert().values(row))
                if quota is not None:
                    # counts the new motion; raising rolls the insert back
                    await _enforce_quota(connection, entry.subject, quota)
        except IntegrityError:
            return False
        return True

    async def _check_quota(self, subject: str, quota: Quota) -> None:
        async with self._engine.connect() as connection:
            await _enforce_quota(connection, subject, quota, 1)

    async def _select_motion(self, motion_id: str) -> CatalogueEntry | None:
        async with self._engine.connect() as connection:
            row = (await connection.execute(select(MOTIONS).where(MOTIONS.c.id == motion_id))).first()
        return _entry_from_row(row) if row is not None else None

    async def _update_description(
        self, motion_id: str, edit: DescriptionEdit, object_bytes: int | None
    ) -> CatalogueEntry | None:
        while True:
            async with self._engine.begin() as connection:
                row = (await connection.execute(select(MOTIONS).where(MOTIONS.c.id == motion_id))).first()
                if row is None:
                    return None
                entry = _entry_from_row(row)
                edited = replace(entry, description=edit(entry))
                # only if the row is unchanged: the same statement works in both databases, without a lock
                unchanged = (MOTIONS.c.id == motion_id, MOTIONS.c.description == row.description)
                statement = update(MOTIONS).where(*unchanged, MOTIONS.c.created == row.created)
                values: dict[str, Any] = {
                    "description": json.dumps(edited.description),
                    **search_columns(edited.description),
                }
                if object_bytes is not None:
                    edited = replace(edited, bytes=object_bytes)
                    values["bytes"] = object_bytes
                if (await connection.execute(statement.values(values))).rowcount:
                    return edited

    async def _fill_search_columns(self) -> bool:
        """Fill the search columns of rows that a replica of an older release added; return whether more may follow."""
        async with self._engine.begin() as connection:
            statement = select(MOTIONS.c.id, MOTIONS.c.description).where(MOTIONS.c.folded_name.is_(None))
            rows = (await connection.execute(statement.limit(_FILL_CHUNK_ROWS))).all()
            for row in rows:
                unchanged = (MOTIONS.c.id == row.id, MOTIONS.c.description == row.description)
                values = search_columns(json.loads(row.description))
                await connection.execute(update(MOTIONS).where(*unchanged).values(values))
        return len(rows) == _FILL_CHUNK_ROWS

    async def _select_motions(
        self, limit: int, after: tuple[int, str] | None, condition: MotionFilter
    ) -> tuple[list[CatalogueEntry], str | None]:
        statement = select(MOTIONS).order_by(MOTIONS.c.created.desc(), MOTIONS.c.id.desc()).limit(limit + 1)
        for word in fold_text(condition.search).split():
            statement = statement.where(MOTIONS.c.folded_name.contains(word, autoescape=True))
        if condition.tag:
            statement = statement.where(MOTIONS.c.folded_tags.contains(fold_tag(condition.tag), autoescape=True))
        if after is not None:
            statement = statement.where(tuple_(MOTIONS.c.created, MOTIONS.c.id) < tuple_(*after))
        async with self._engine.connect() as connection:
            entries = [_entry_from_row(row) for row in (await connection.execute(statement)).all()]
        if len(entries) <= limit:
            return entries, None
        last = entries[limit - 1]
        return entries[:limit], write_cursor(last.created, last.id)

    async def _delete_motion(self, motion_id: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(MOTIONS).where(MOTIONS.c.id == motion_id))).rowcount > 0

    async def _select_motion_keys(self, limit: int, after: str) -> list[MotionKey]:
        statement = (
            select(MOTIONS.c.id, MOTIONS.c.created, MOTIONS.c.bytes)
            .where(MOTIONS.c.id > after)
            .order_by(MOTIONS.c.id)
            .limit(limit)
        )
        async with self._engine.connect() as connection:
            return [MotionKey(row.id, row.created, row.bytes or 0) for row in await connection.execute(statement)]

    async def _select_existing(self, column: Column[str], ids: list[str]) -> set[str]:
        async with self._engine.connect() as connection:
            return set((await connection.execute(select(column).where(column.in_(ids)))).scalars())

    async def _schema_version(self) -> str | None:
        async with self._engine.connect() as connection:
            return await connection.run_sync(read_schema_version)

    async def _run_query(self, query: Coroutine[Any, Any, Result], *, limit_time: bool = True) -> Result:
        try:
            return await self._timeout.wait(query, BACKEND_TIMEOUT_S if self._postgres and limit_time else None)
        except (DBAPIError, NoConnection, OSError) as error:
            if isinstance(error, DBAPIError) and self._is_disk_full(error):
                raise insufficient_storage("the catalogue") from error
            if isinstance(error, DBAPIError) and not _is_outage(error):
                raise
            cause = error.orig if isinstance(error, DBAPIError) else error
            raise BackendUnavailable("the catalogue", str(cause) or type(cause).__name__) from error

    def _is_disk_full(self, error: DBAPIError) -> bool:
        if isinstance(error.orig, sqlite3.Error):
            if getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL:
                return True
            # without a free inode, the journal cannot be created
            return self.reserve is not None and _may_lack_space(error) and self.reserve.is_disk_full()
        return str(getattr(error.orig, "sqlstate", "")) == _DISK_FULL_SQLSTATE

    async def _run_removal(self, create_query: Callable[[], Coroutine[Any, Any, Result]]) -> Result:
        """Run a query that removes rows. If there is no space for it, run it again in the reserved space."""
        try:
            return await self._run_query(create_query())
        except (ProblemError, BackendUnavailable) as error:
            if self.reserve is None or not _may_lack_space(error.__cause__):
                raise
            if not await asyncio.to_thread(self.reserve.release):
                raise
        try:
            return await self._run_query(create_query())
        finally:
            # at once, before other writers use the space
            await asyncio.to_thread(self.reserve.restore)


def _make_commits_durable(connection: Any, _: Any) -> None:
    cursor = connection.cursor()
    cursor.execute("PRAGMA synchronous=EXTRA")
    cursor.close()


def _may_lack_space(error: BaseException | None) -> bool:
    """Return whether an error of SQLite may come from a full disk or quota."""
    code = getattr(getattr(error, "orig", None), "sqlite_errorcode", None)
    return code is not None and code & 0xFF in _SQLITE_SPACE_ERRORS


def _is_outage(error: DBAPIError) -> bool:
    """Return whether the error is a passing outage of the database, not an error of the statement or a full disk."""
    if isinstance(error.orig, sqlite3.Error):
        return isinstance(error, OperationalError) and error.orig.sqlite_errorcode != sqlite3.SQLITE_FULL
    return not str(getattr(error.orig, "sqlstate", "")).startswith(_CALLER_SQLSTATES)


def _entry_from_row(row: Row[Any]) -> CatalogueEntry:
    # rows from before quotas have neither subject nor size
    return CatalogueEntry(row.id, row.created, json.loads(row.description), row.subject or "", row.bytes or 0)


async def _enforce_quota(connection: AsyncConnection, subject: str, quota: Quota, additional: int = 0) -> None:
    """Raise `QuotaExceeded` if the stored motions plus `additional` ones exceed a limit."""
    counted = select(func.count(), func.coalesce(func.sum(MOTIONS.c.bytes), 0))
    limits = (
        (counted.where(MOTIONS.c.subject == subject), quota.max_motions, quota.max_bytes, "you may store"),
        (counted, quota.max_total_motions, quota.max_total_bytes, "this server stores"),
    )
    for statement, max_motions, max_bytes, scope in limits:
        if not max_motions and not max_bytes:
            continue
        motions, size = (await connection.execute(statement)).one()
        if max_motions and motions + additional > max_motions:
            raise QuotaExceeded(f"{scope} at most {max_motions} motions")
        if max_bytes and size + additional > max_bytes:
            raise QuotaExceeded(f"{scope} at most {max_bytes} bytes of motions")
