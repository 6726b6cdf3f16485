"""SQL table of props. Their models are in its rows, so that no prop is without one."""

from __future__ import annotations

import builtins
import json
from typing import Any

from sqlalchemy import Row, delete, func, select, text, tuple_
from sqlalchemy.exc import IntegrityError
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.storage.cursor import parse_cursor, write_cursor
from bunraku.storage.record import PropQuota, QuotaExceeded, StoredProp, is_motion_id
from bunraku.storage.table import PROPS, QueryRunner, RemovalRunner

_QUOTA_LOCK_ID = 0x70726F7073
"""Key of the advisory lock in PostgreSQL under which props are counted and added."""
_WITHOUT_MODEL = [column for column in PROPS.columns if column is not PROPS.c.model]


class SqlPropTable:
    """Table of props; `Catalogue` documents the methods."""

    def __init__(self, engine: AsyncEngine, run_query: QueryRunner, run_removal: RemovalRunner) -> None:
        self._engine = engine
        self._run_query = run_query
        self._run_removal = run_removal

    async def add(self, prop: StoredProp, model: bytes, quota: PropQuota) -> bool:
        """Add a prop and return whether it is new; raise `QuotaExceeded`, with nothing added, beyond `quota`."""
        return await self._run_query(self._add(prop, model, quota))

    async def check_quota(self, subject: str, quota: PropQuota) -> None:
        """Raise `QuotaExceeded` if `subject` cannot add one more prop."""
        await self._run_query(self._check_quota(subject, quota))

    async def get(self, prop_id: str) -> StoredProp | None:
        """Return a prop, None if it does not exist."""
        if not is_motion_id(prop_id):
            return None
        rows = await self._run_query(self._select(select(*_WITHOUT_MODEL).where(PROPS.c.id == prop_id)))
        return _prop_from_row(rows[0]) if rows else None

    async def get_model(self, prop_id: str) -> bytes | None:
        """Return the model of a prop, None if it does not exist."""
        if not is_motion_id(prop_id):
            return None
        rows = await self._run_query(self._select(select(PROPS.c.model).where(PROPS.c.id == prop_id)))
        return bytes(rows[0].model) if rows else None

    async def list(self, limit: int, cursor: str | None = None) -> tuple[builtins.list[StoredProp], str | None]:
        """Return at most `limit` props, newest first, and the next page's cursor; raise `InvalidCursor`."""
        order = PROPS.c.created.desc(), PROPS.c.id.desc()
        statement = select(*_WITHOUT_MODEL).order_by(*order).limit(limit + 1)
        if cursor is not None:
            statement = statement.where(tuple_(PROPS.c.created, PROPS.c.id) < tuple_(*parse_cursor(cursor)))
        props = [_prop_from_row(row) for row in await self._run_query(self._select(statement))]
        if len(props) <= limit:
            return props, None
        return props[:limit], write_cursor(props[limit - 1].created, props[limit - 1].id)

    async def remove(self, prop_id: str) -> bool:
        """Remove a prop and return whether it existed."""
        return is_motion_id(prop_id) and await self._run_removal(lambda: self._remove(prop_id))

    async def _add(self, prop: StoredProp, model: bytes, quota: PropQuota) -> bool:
        row = {
            "id": prop.id,
            "created": prop.created,
            "subject": prop.subject,
            "description": json.dumps(prop.description),
            "model": model,
        }
        try:
            async with self._engine.begin() as connection:
                if self._engine.dialect.name == "postgresql":
                    # SQLite needs no lock: it admits one writer from the insert on
                    await connection.execute(text(f"SELECT pg_advisory_xact_lock({_QUOTA_LOCK_ID})"))
                await connection.execute(PROPS.insert().values(row))
                # counts the new prop; raising rolls the insert back
                await _enforce_quota(connection, prop.subject, quota)
        except IntegrityError:
            return False
        return True

    async def _check_quota(self, subject: str, quota: PropQuota) -> None:
        async with self._engine.connect() as connection:
            await _enforce_quota(connection, subject, quota, 1)

    async def _select(self, statement: Any) -> builtins.list[Row[Any]]:
        async with self._engine.connect() as connection:
            return list((await connection.execute(statement)).all())

    async def _remove(self, prop_id: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(PROPS).where(PROPS.c.id == prop_id))).rowcount > 0


def _prop_from_row(row: Row[Any]) -> StoredProp:
    return StoredProp(row.id, row.created, json.loads(row.description), row.subject)


async def _enforce_quota(connection: Any, subject: str, quota: PropQuota, additional: int = 0) -> None:
    """Raise `QuotaExceeded` if the stored props plus `additional` ones exceed a limit."""
    counted = select(func.count()).select_from(PROPS)
    limits = (
        (counted.where(PROPS.c.subject == subject), quota.max_props, "you may store"),
        (counted, quota.max_total_props, "this server stores"),
    )
    for statement, max_props, scope in limits:
        if max_props and (await connection.execute(statement)).scalar_one() + additional > max_props:
            raise QuotaExceeded(f"{scope} at most {max_props} props")
