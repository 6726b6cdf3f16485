"""What motions there are: one row each."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bunraku.backing.catalogue_sql import SqlCatalogue

SCHEMES = ("sqlite", "postgresql")


class BadCursor(ValueError):
    """A cursor that this catalogue did not give."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A motion as the catalogue knows it: `created` in microseconds since 1970, `description` as JSON says it."""

    id: str
    created: int
    description: dict[str, Any]


class Catalogue:
    """The catalogue at `sqlite:///path` or `postgresql://...`.

    It is opened at its first use, or by `open`: loading SQLAlchemy takes seconds on a small machine, and a stage can
    be seen without it. Raises ValueError for another address. Every method raises `Unavailable` while the database is
    away.
    """

    def __init__(self, url: str) -> None:
        if url.split(":", 1)[0] not in SCHEMES:
            raise ValueError(f"a catalogue is at sqlite:///path or postgresql://host/name, not {url!r}")
        self._url = url
        self._opening: asyncio.Task[SqlCatalogue] | None = None

    async def open(self) -> SqlCatalogue:
        """The catalogue itself; who comes second waits for the first. After a failure the next call tries again."""
        if self._opening is None or (self._opening.done() and self._opening.exception() is not None):
            self._opening = asyncio.create_task(self._open(), name="open the catalogue")
        return await asyncio.shield(self._opening)

    async def close(self) -> None:
        """Close every connection."""
        if self._opening is not None:
            await asyncio.wait((self._opening,))
            if self._opening.exception() is None:
                await self._opening.result().close()

    async def add(self, entry: Entry) -> bool:
        """Add a motion; whether it was new."""
        return await (await self.open()).add(entry)

    async def get(self, motion: str) -> Entry | None:
        """The motion of this id."""
        return await (await self.open()).get(motion)

    async def page(self, limit: int, cursor: str | None = None) -> tuple[list[Entry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        return await (await self.open()).page(limit, cursor)

    async def remove(self, motion: str) -> bool:
        """Remove a motion; whether it was there."""
        return await (await self.open()).remove(motion)

    async def _open(self) -> SqlCatalogue:
        def load() -> type[SqlCatalogue]:
            from bunraku.backing.catalogue_sql import SqlCatalogue

            return SqlCatalogue

        return await (await asyncio.to_thread(load)).open(self._url)
