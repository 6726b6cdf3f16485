"""SQL table of viewer links."""

from __future__ import annotations

import builtins
from dataclasses import asdict
from typing import Any

from sqlalchemy import Row, delete, func, select, text
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.storage.record import QuotaExceeded, Share, ShareScope
from bunraku.storage.table import SHARES, QueryRunner, RemovalRunner

_QUOTA_LOCK_ID = 0x6C696E6B73
"""Key of the advisory lock in PostgreSQL under which links are counted and added."""


class SqlShareTable:
    """Table of viewer links; `Catalogue` documents the methods."""

    def __init__(self, engine: AsyncEngine, run_query: QueryRunner, run_removal: RemovalRunner) -> None:
        self._engine = engine
        self._run_query = run_query
        self._run_removal = run_removal

    async def add(self, share: Share, max_per_subject: int = 0) -> None:
        """Add a link and remove expired ones; raise `QuotaExceeded` beyond `max_per_subject` links of its subject."""
        await self._run_query(self._add(share, max_per_subject))

    async def get(self, share_id: str) -> Share | None:
        """Return a link, None if it does not exist."""
        rows = await self._run_query(self._select(select(SHARES).where(SHARES.c.id == share_id)))
        return rows[0] if rows else None

    async def list(self, scope: ShareScope, limit: int) -> builtins.list[Share]:
        """Return the newest links of a scope."""
        statement = select(SHARES).order_by(SHARES.c.created.desc(), SHARES.c.id.desc()).limit(limit)
        for name, value in asdict(scope).items():
            if value is not None:
                statement = statement.where(SHARES.c[name] == value)
        return await self._run_query(self._select(statement))

    async def remove(self, share_id: str) -> bool:
        """Remove a link and return whether it existed."""
        return await self._run_removal(lambda: self._remove(share_id))

    async def _add(self, share: Share, max_per_subject: int) -> None:
        row = {column.name: getattr(share, column.name) for column in SHARES.columns}
        async with self._engine.begin() as connection:
            if max_per_subject and self._engine.dialect.name == "postgresql":
                # SQLite needs no lock: it admits one writer from the first change on
                await connection.execute(text(f"SELECT pg_advisory_xact_lock({_QUOTA_LOCK_ID})"))
            await connection.execute(delete(SHARES).where(SHARES.c.expires <= share.created))
            await connection.execute(SHARES.insert().values(row))
            if max_per_subject:
                # counts the new link; raising rolls the insert back
                counted = select(func.count()).select_from(SHARES).where(SHARES.c.subject == share.subject)
                if (await connection.execute(counted)).scalar_one() > max_per_subject:
                    raise QuotaExceeded(f"you may have at most {max_per_subject} links that have not expired")

    async def _select(self, statement: Any) -> builtins.list[Share]:
        async with self._engine.connect() as connection:
            return [_share_from_row(row) for row in (await connection.execute(statement)).all()]

    async def _remove(self, share_id: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(SHARES).where(SHARES.c.id == share_id))).rowcount > 0


def _share_from_row(row: Row[Any]) -> Share:
    return Share(row.id, row.created, row.expires, row.subject, row.session, row.motion)
