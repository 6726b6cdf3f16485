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

from bunraku.backing.catalogue import BadCursor, Entry, Quota, QuotaUsedUp
from bunraku.backing.full import full
from bunraku.backing.jobs_sql import SqlJobs
from bunraku.backing.migrate import HEAD, migrate, version
from bunraku.backing.shares_sql import SqlShares
from bunraku.backing.tables import MOTIONS
from bunraku.backing.unavailable import ANSWERED, Patience, Unavailable

_COUNTING = 0x636F756E74
"""The name of PostgreSQL's advisory lock under which motions are counted and added."""
_DRIVERS = {"sqlite": "sqlite+aiosqlite", "postgresql": "postgresql+asyncpg"}
_OURS = ("22", "23", "42", "53100")
"""SQLSTATEs of PostgreSQL that are not its own trouble: of data, constraints and statements, and the full disk."""
_FULL = "53100"

Found = TypeVar("Found")


class SqlCatalogue:
    """The tables of motions and jobs. Every method raises `Unavailable` where the database is away, and PostgreSQL's
    also where it does not answer within `ANSWERED`; once it is back they work again. Where its disk is full what adds
    something raises `ProblemError`, 507."""

    def __init__(self, url: str) -> None:
        """`url` is SQLAlchemy's, of an async driver."""
        self._url = url
        self._postgres = url.startswith("postgresql")
        self._patience = Patience("the catalogue")
        limits = {
            "pool_pre_ping": True,
            "pool_timeout": ANSWERED,
            "connect_args": {"timeout": ANSWERED, "command_timeout": ANSWERED},
        }
        self._engine: AsyncEngine = create_async_engine(url, **(limits if self._postgres else {}))
        self.jobs = SqlJobs(self._engine, self._answer)
        self.shares = SqlShares(self._engine, self._answer)

    @classmethod
    async def open(cls, url: str) -> SqlCatalogue:
        """The catalogue at `sqlite:///path` or `postgresql://...`, brought to the version of this code; raises
        `UnknownVersion` where it is of a newer one."""
        scheme, rest = url.split(":", 1)
        catalogue = cls(f"{_DRIVERS[scheme]}:{rest}")
        try:
            # the driver's own limits do: what is loaded at first may take a while
            if await catalogue._answer(catalogue._version(), hurry=False) != HEAD:
                await catalogue._answer(asyncio.to_thread(migrate, catalogue._url), hurry=False)
        except BaseException:
            await catalogue.close()
            raise
        return catalogue

    async def close(self) -> None:
        """Close every connection."""
        await self._patience.end()
        await self._engine.dispose()

    async def add(self, entry: Entry, quota: Quota | None = None) -> bool:
        """Add a motion; whether it was new. Raises `QuotaUsedUp` where it is one too many, and nothing is added."""
        return await self._answer(self._add(entry, quota))

    async def check(self, subject: str, quota: Quota) -> None:
        """Whether `subject` may add one more motion, if it is small; raises `QuotaUsedUp`."""
        await self._answer(self._check(subject, quota))

    async def get(self, motion: str) -> Entry | None:
        """The motion of this id."""
        return await self._answer(self._get(motion)) if _is_id(motion) else None

    async def page(self, limit: int, cursor: str | None = None) -> tuple[list[Entry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        return await self._answer(self._page(limit, _read_cursor(cursor) if cursor is not None else None))

    async def remove(self, motion: str) -> bool:
        """Remove a motion; whether it was there."""
        return _is_id(motion) and await self._answer(self._remove(motion))

    async def _add(self, entry: Entry, quota: Quota | None) -> bool:
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
                    await connection.execute(text(f"SELECT pg_advisory_xact_lock({_COUNTING})"))
                await connection.execute(MOTIONS.insert().values(row))
                if quota is not None:
                    # with the new one counted; what is raised here takes it back
                    await _count(connection, entry.subject, quota)
        except IntegrityError:
            return False
        return True

    async def _check(self, subject: str, quota: Quota) -> None:
        async with self._engine.connect() as connection:
            await _count(connection, subject, quota, 1)

    async def _get(self, motion: str) -> Entry | None:
        async with self._engine.connect() as connection:
            row = (await connection.execute(select(MOTIONS).where(MOTIONS.c.id == motion))).first()
        return _entry(row) if row is not None else None

    async def _page(self, limit: int, after: tuple[int, str] | None) -> tuple[list[Entry], str | None]:
        statement = select(MOTIONS).order_by(MOTIONS.c.created.desc(), MOTIONS.c.id.desc()).limit(limit + 1)
        if after is not None:
            statement = statement.where(tuple_(MOTIONS.c.created, MOTIONS.c.id) < tuple_(*after))
        async with self._engine.connect() as connection:
            entries = [_entry(row) for row in (await connection.execute(statement)).all()]
        if len(entries) <= limit:
            return entries, None
        last = entries[limit - 1]
        return entries[:limit], base64.urlsafe_b64encode(f"{last.created}:{last.id}".encode()).decode()

    async def _remove(self, motion: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(MOTIONS).where(MOTIONS.c.id == motion))).rowcount > 0

    async def _version(self) -> str | None:
        async with self._engine.connect() as connection:
            return await connection.run_sync(version)

    async def _answer(self, asking: Coroutine[Any, Any, Found], *, hurry: bool = True) -> Found:
        """What the database answers; raises `Unavailable`."""
        try:
            return await self._patience.wait(asking, ANSWERED if self._postgres and hurry else None)
        except (DBAPIError, NoConnection, OSError) as error:
            if isinstance(error, DBAPIError) and _is_full(error):
                raise full("the catalogue") from error
            if isinstance(error, DBAPIError) and not _is_away(error):
                raise
            cause = error.orig if isinstance(error, DBAPIError) else error
            raise Unavailable("the catalogue", str(cause) or type(cause).__name__) from error


def _is_away(error: DBAPIError) -> bool:
    """Whether it is the database's trouble, which passes, and not that of the statement or a full disk."""
    if isinstance(error.orig, sqlite3.Error):
        return isinstance(error, OperationalError) and error.orig.sqlite_errorcode != sqlite3.SQLITE_FULL
    return not str(getattr(error.orig, "sqlstate", "")).startswith(_OURS)


def _is_full(error: DBAPIError) -> bool:
    if isinstance(error.orig, sqlite3.Error):
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
    return str(getattr(error.orig, "sqlstate", "")) == _FULL


def _is_id(motion: str) -> bool:
    """Whether this could be an id: not all text is to all databases."""
    return motion.isascii() and motion.isalnum()


def _entry(row: Row[Any]) -> Entry:
    # rows from before there were quotas say neither whose they are nor how large
    return Entry(row.id, row.created, json.loads(row.description), row.subject or "", row.bytes or 0)


async def _count(connection: AsyncConnection, subject: str, quota: Quota, more: int = 0) -> None:
    """Raise `QuotaUsedUp` where what is kept, and `more` motions, are beyond a quota."""
    counted = select(func.count(), func.coalesce(func.sum(MOTIONS.c.bytes), 0))
    limits = (
        (counted.where(MOTIONS.c.subject == subject), quota.motions, quota.bytes, "you may keep"),
        (counted, quota.total_motions, quota.total_bytes, "this server keeps"),
    )
    for statement, most_motions, most_bytes, who in limits:
        if not most_motions and not most_bytes:
            continue
        motions, size = (await connection.execute(statement)).one()
        if most_motions and motions + more > most_motions:
            raise QuotaUsedUp(f"{who} {most_motions} motions at most")
        if most_bytes and size + more > most_bytes:
            raise QuotaUsedUp(f"{who} {most_bytes} bytes of motions at most")


def _read_cursor(cursor: str) -> tuple[int, str]:
    try:
        created, motion = base64.urlsafe_b64decode(cursor.encode()).decode().split(":", 1)
        if not _is_id(motion):
            raise ValueError(motion)
        return min(max(int(created), 0), (1 << 63) - 1), motion
    except (ValueError, binascii.Error):
        raise BadCursor("the cursor is not one of this list; leave it out to start anew") from None
