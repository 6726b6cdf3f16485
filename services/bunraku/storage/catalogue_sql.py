"""The catalogue in SQL: SQLite by default, PostgreSQL by URL; the same statements on both."""

from __future__ import annotations

import asyncio
import base64
import binascii
import json
import sqlite3
from collections.abc import Coroutine
from typing import Any, TypeVar

from sqlalchemy import Row, delete, func, select, text, tuple_
from sqlalchemy.exc import DBAPIError, IntegrityError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnection
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine

from bunraku.http.problem_details import insufficient_storage
from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendTimeout, BackendUnavailable
from bunraku.storage.catalogue import CatalogueEntry, InvalidCursor, Quota, QuotaExceeded
from bunraku.storage.job_sql import SqlJobTable
from bunraku.storage.migration import HEAD_REVISION, migrate, read_schema_version
from bunraku.storage.share_sql import SqlShareTable
from bunraku.storage.table import MOTIONS

_QUOTA_LOCK_ID = 0x636F756E74
"""The name of PostgreSQL's advisory lock under which motions are counted and added."""
_DRIVERS = {"sqlite": "sqlite+aiosqlite", "postgresql": "postgresql+asyncpg"}
_CALLER_SQLSTATES = ("22", "23", "42", "53100")
"""SQLSTATEs of PostgreSQL that are not its own trouble: of data, constraints and statements, and the full disk."""
_DISK_FULL_SQLSTATE = "53100"

Found = TypeVar("Found")


class SqlCatalogue:
    """The tables of motions and jobs. Every method raises `Unavailable` where the database is away, and PostgreSQL's
    also where it does not answer within `ANSWERED`; once it is back they work again. Where its disk is full what adds
    something raises `ProblemError`, 507."""

    def __init__(self, url: str) -> None:
        """`url` is SQLAlchemy's, of an async driver."""
        self._url = url
        self._postgres = url.startswith("postgresql")
        self._timeout = BackendTimeout("the catalogue")
        limits = {
            "pool_pre_ping": True,
            "pool_timeout": BACKEND_TIMEOUT_S,
            "connect_args": {"timeout": BACKEND_TIMEOUT_S, "command_timeout": BACKEND_TIMEOUT_S},
        }
        self._engine: AsyncEngine = create_async_engine(url, **(limits if self._postgres else {}))
        self.jobs = SqlJobTable(self._engine, self._run_query)
        self.shares = SqlShareTable(self._engine, self._run_query)

    @classmethod
    async def open(cls, url: str) -> SqlCatalogue:
        """The catalogue at `sqlite:///path` or `postgresql://...`, brought to the version of this code; raises
        `UnknownVersion` where it is of a newer one."""
        scheme, rest = url.split(":", 1)
        catalogue = cls(f"{_DRIVERS[scheme]}:{rest}")
        try:
            # the driver's own limits do: what is loaded at first may take a while
            if await catalogue._run_query(catalogue._schema_version(), limit_time=False) != HEAD_REVISION:
                await catalogue._run_query(asyncio.to_thread(migrate, catalogue._url), limit_time=False)
        except BaseException:
            await catalogue.close()
            raise
        return catalogue

    async def close(self) -> None:
        """Close every connection."""
        await self._timeout.drain_abandoned()
        await self._engine.dispose()

    async def add_motion(self, entry: CatalogueEntry, quota: Quota | None = None) -> bool:
        """Add a motion; whether it was new. Raises `QuotaUsedUp` where it is one too many, and nothing is added."""
        return await self._run_query(self._insert_motion(entry, quota))

    async def check_quota(self, subject: str, quota: Quota) -> None:
        """Whether `subject` may add one more motion, if it is small; raises `QuotaUsedUp`."""
        await self._run_query(self._check_quota(subject, quota))

    async def get_motion(self, motion_id: str) -> CatalogueEntry | None:
        """The motion of this id."""
        return await self._run_query(self._select_motion(motion_id)) if _is_motion_id(motion_id) else None

    async def list_motions(self, limit: int, cursor: str | None = None) -> tuple[list[CatalogueEntry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        return await self._run_query(self._select_motions(limit, _parse_cursor(cursor) if cursor is not None else None))

    async def remove_motion(self, motion_id: str) -> bool:
        """Remove a motion; whether it was there."""
        return _is_motion_id(motion_id) and await self._run_query(self._delete_motion(motion_id))

    async def _insert_motion(self, entry: CatalogueEntry, quota: Quota | None) -> bool:
        row = {
            "id": entry.id,
            "created": entry.created,
            "description": json.dumps(entry.description),
            "subject": entry.subject,
            "bytes": entry.bytes,
        }
        try:
            async with self._engine.begin() as connection:
                if quota is not None and self._postgres:
                    # SQLite has one writer at a time from the insert on
                    await connection.execute(text(f"SELECT pg_advisory_xact_lock({_QUOTA_LOCK_ID})"))
                await connection.execute(MOTIONS.insert().values(row))
                if quota is not None:
                    # with the new one counted; what is raised here takes it back
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

    async def _select_motions(
        self, limit: int, after: tuple[int, str] | None
    ) -> tuple[list[CatalogueEntry], str | None]:
        statement = select(MOTIONS).order_by(MOTIONS.c.created.desc(), MOTIONS.c.id.desc()).limit(limit + 1)
        if after is not None:
            statement = statement.where(tuple_(MOTIONS.c.created, MOTIONS.c.id) < tuple_(*after))
        async with self._engine.connect() as connection:
            entries = [_entry_from_row(row) for row in (await connection.execute(statement)).all()]
        if len(entries) <= limit:
            return entries, None
        last = entries[limit - 1]
        return entries[:limit], base64.urlsafe_b64encode(f"{last.created}:{last.id}".encode()).decode()

    async def _delete_motion(self, motion_id: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(MOTIONS).where(MOTIONS.c.id == motion_id))).rowcount > 0

    async def _schema_version(self) -> str | None:
        async with self._engine.connect() as connection:
            return await connection.run_sync(read_schema_version)

    async def _run_query(self, query: Coroutine[Any, Any, Found], *, limit_time: bool = True) -> Found:
        """What the database answers; raises `Unavailable`."""
        try:
            return await self._timeout.wait(query, BACKEND_TIMEOUT_S if self._postgres and limit_time else None)
        except (DBAPIError, NoConnection, OSError) as error:
            if isinstance(error, DBAPIError) and _is_disk_full(error):
                raise insufficient_storage("the catalogue") from error
            if isinstance(error, DBAPIError) and not _is_outage(error):
                raise
            cause = error.orig if isinstance(error, DBAPIError) else error
            raise BackendUnavailable("the catalogue", str(cause) or type(cause).__name__) from error


def _is_outage(error: DBAPIError) -> bool:
    """Whether it is the database's trouble, which passes, and not that of the statement or a full disk."""
    if isinstance(error.orig, sqlite3.Error):
        return isinstance(error, OperationalError) and error.orig.sqlite_errorcode != sqlite3.SQLITE_FULL
    return not str(getattr(error.orig, "sqlstate", "")).startswith(_CALLER_SQLSTATES)


def _is_disk_full(error: DBAPIError) -> bool:
    if isinstance(error.orig, sqlite3.Error):
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
    return str(getattr(error.orig, "sqlstate", "")) == _DISK_FULL_SQLSTATE


def _is_motion_id(text_id: str) -> bool:
    """Whether this could be an id: not all text is to all databases."""
    return text_id.isascii() and text_id.isalnum()


def _entry_from_row(row: Row[Any]) -> CatalogueEntry:
    # rows from before there were quotas say neither whose they are nor how large
    return CatalogueEntry(row.id, row.created, json.loads(row.description), row.subject or "", row.bytes or 0)


async def _enforce_quota(connection: AsyncConnection, subject: str, quota: Quota, additional: int = 0) -> None:
    """Raise `QuotaUsedUp` where what is kept, and `more` motions, are beyond a quota."""
    counted = select(func.count(), func.coalesce(func.sum(MOTIONS.c.bytes), 0))
    limits = (
        (counted.where(MOTIONS.c.subject == subject), quota.max_motions, quota.max_bytes, "you may keep"),
        (counted, quota.max_total_motions, quota.max_total_bytes, "this server keeps"),
    )
    for statement, most_motions, most_bytes, who in limits:
        if not most_motions and not most_bytes:
            continue
        motions, size = (await connection.execute(statement)).one()
        if most_motions and motions + additional > most_motions:
            raise QuotaExceeded(f"{who} {most_motions} motions at most")
        if most_bytes and size + additional > most_bytes:
            raise QuotaExceeded(f"{who} {most_bytes} bytes of motions at most")


def _parse_cursor(cursor: str) -> tuple[int, str]:
    try:
        created, motion = base64.urlsafe_b64decode(cursor.encode()).decode().split(":", 1)
        if not _is_motion_id(motion):
            raise ValueError(motion)
        return min(max(int(created), 0), (1 << 63) - 1), motion
    except (ValueError, binascii.Error):
        raise InvalidCursor("the cursor is not one of this list; leave it out to start anew") from None
