"""The catalogue in SQL: SQLite by default, PostgreSQL by URL; the same statements on both."""

from __future__ import annotations

import base64
import binascii
import json
from typing import Any

from sqlalchemy import BigInteger, Column, MetaData, Row, String, Table, Text, delete, select, tuple_
from sqlalchemy.exc import IntegrityError
from sqlalchemy.ext.asyncio import AsyncEngine, create_async_engine

from bunraku.backing.catalogue import BadCursor, Entry

METADATA = MetaData()
MOTIONS = Table(
    "motions",
    METADATA,
    Column("id", String(32), primary_key=True),
    Column("created", BigInteger, nullable=False, index=True),
    Column("description", Text, nullable=False),
)
_DRIVERS = {"sqlite": "sqlite+aiosqlite", "postgresql": "postgresql+asyncpg"}


class SqlCatalogue:
    """The table of motions."""

    def __init__(self, engine: AsyncEngine) -> None:
        self._engine = engine

    @classmethod
    async def open(cls, url: str) -> SqlCatalogue:
        """The catalogue at `sqlite:///path` or `postgresql://...`, its table made where it is missing."""
        scheme, rest = url.split(":", 1)
        engine = create_async_engine(f"{_DRIVERS[scheme]}:{rest}", pool_pre_ping=scheme != "sqlite")
        async with engine.begin() as connection:
            await connection.run_sync(METADATA.create_all)
        return cls(engine)

    async def close(self) -> None:
        """Close every connection."""
        await self._engine.dispose()

    async def add(self, entry: Entry) -> bool:
        """Add a motion; whether it was new."""
        row = {"id": entry.id, "created": entry.created, "description": json.dumps(entry.description)}
        try:
            async with self._engine.begin() as connection:
                await connection.execute(MOTIONS.insert().values(row))
        except IntegrityError:
            return False
        return True

    async def get(self, motion: str) -> Entry | None:
        """The motion of this id."""
        async with self._engine.connect() as connection:
            row = (await connection.execute(select(MOTIONS).where(MOTIONS.c.id == motion))).first()
        return _entry(row) if row is not None else None

    async def page(self, limit: int, cursor: str | None = None) -> tuple[list[Entry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        statement = select(MOTIONS).order_by(MOTIONS.c.created.desc(), MOTIONS.c.id.desc()).limit(limit + 1)
        if cursor is not None:
            statement = statement.where(tuple_(MOTIONS.c.created, MOTIONS.c.id) < tuple_(*_read_cursor(cursor)))
        async with self._engine.connect() as connection:
            entries = [_entry(row) for row in (await connection.execute(statement)).all()]
        if len(entries) <= limit:
            return entries, None
        last = entries[limit - 1]
        return entries[:limit], base64.urlsafe_b64encode(f"{last.created}:{last.id}".encode()).decode()

    async def remove(self, motion: str) -> bool:
        """Remove a motion; whether it was there."""
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(MOTIONS).where(MOTIONS.c.id == motion))).rowcount > 0


def _entry(row: Row[Any]) -> Entry:
    return Entry(row.id, row.created, json.loads(row.description))


def _read_cursor(cursor: str) -> tuple[int, str]:
    try:
        created, motion = base64.urlsafe_b64decode(cursor.encode()).decode().split(":", 1)
        return min(max(int(created), 0), (1 << 63) - 1), motion
    except (ValueError, binascii.Error):
        raise BadCursor("the cursor is not one of this list; leave it out to start anew") from None
