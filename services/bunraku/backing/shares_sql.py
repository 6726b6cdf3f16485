"""Links for viewers in SQL."""

from __future__ import annotations

import builtins
from typing import Any

from sqlalchemy import Row, delete, select
from sqlalchemy.ext.asyncio import AsyncEngine

from bunraku.backing.catalogue import Share
from bunraku.backing.tables import SHARES, Answer


class SqlShares:
    """The table of links; each method as that of `Catalogue`."""

    def __init__(self, engine: AsyncEngine, answer: Answer) -> None:
        self._engine = engine
        self._answer = answer

    async def add(self, share: Share) -> None:
        """Add one."""
        await self._answer(self._add(share))

    async def get(self, share: str) -> Share | None:
        """The one of this id."""
        found = await self._answer(self._select(select(SHARES).where(SHARES.c.id == share)))
        return found[0] if found else None

    async def list(self, subject: str | None, limit: int) -> builtins.list[Share]:
        """The newest, of one subject or of all."""
        statement = select(SHARES).order_by(SHARES.c.created.desc(), SHARES.c.id.desc()).limit(limit)
        if subject is not None:
            statement = statement.where(SHARES.c.subject == subject)
        return await self._answer(self._select(statement))

    async def remove(self, share: str) -> bool:
        """Revoke one; whether it was there."""
        return await self._answer(self._remove(share))

    async def _add(self, share: Share) -> None:
        row = {column.name: getattr(share, column.name) for column in SHARES.columns}
        async with self._engine.begin() as connection:
            await connection.execute(delete(SHARES).where(SHARES.c.expires < share.created))
            await connection.execute(SHARES.insert().values(row))

    async def _select(self, statement: Any) -> builtins.list[Share]:
        async with self._engine.connect() as connection:
            return [_share(row) for row in (await connection.execute(statement)).all()]

    async def _remove(self, share: str) -> bool:
        async with self._engine.begin() as connection:
            return (await connection.execute(delete(SHARES).where(SHARES.c.id == share))).rowcount > 0


def _share(row: Row[Any]) -> Share:
    return Share(row.id, row.created, row.expires, row.subject, row.session, row.motion)
