"""What motions there are, what links for viewers, and the jobs of which there will be more motions: one row each."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bunraku.backing.catalogue_sql import SqlCatalogue

SCHEMES = ("sqlite", "postgresql")


class BadCursor(ValueError):
    """A cursor that this catalogue did not give."""


class QuotaUsedUp(Exception):
    """One motion more than may be kept; the text says of what there is too much."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A motion as the catalogue knows it: `created` in microseconds since 1970, `description` as JSON says it, the
    `subject` who stored it, and the `bytes` that are kept of it."""

    id: str
    created: int
    description: dict[str, Any]
    subject: str = ""
    bytes: int = 0


@dataclass(frozen=True, slots=True)
class Quota:
    """How much may be kept: motions and bytes of one subject, and of all; 0 is any number."""

    motions: int = 0
    bytes: int = 0
    total_motions: int = 0
    total_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Share:
    """A link for viewers of a session or a motion, made by `subject`; times in seconds since 1970."""

    id: str
    created: int
    expires: int
    subject: str
    session: str | None = None
    motion: str | None = None


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be made a motion of: `created` in microseconds since 1970, `details` as JSON says them, `tries` how
    often it was taken up after its first replica had left it."""

    id: str
    created: int
    details: dict[str, Any]
    tries: int = 0


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

    async def add(self, entry: Entry, quota: Quota | None = None) -> bool:
        """Add a motion; whether it was new. Raises `QuotaUsedUp` where it is one too many, and nothing is added."""
        return await (await self.open()).add(entry, quota)

    async def check(self, subject: str, quota: Quota) -> None:
        """Whether `subject` may add one more motion, if it is small; raises `QuotaUsedUp`."""
        await (await self.open()).check(subject, quota)

    async def get(self, motion: str) -> Entry | None:
        """The motion of this id."""
        return await (await self.open()).get(motion)

    async def page(self, limit: int, cursor: str | None = None) -> tuple[list[Entry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        return await (await self.open()).page(limit, cursor)

    async def remove(self, motion: str) -> bool:
        """Remove a motion; whether it was there."""
        return await (await self.open()).remove(motion)

    async def add_job(self, job: Job, holder: str, until: int) -> None:
        """Add a job, held by a replica until clock time `until`; one of the same id is taken over."""
        await (await self.open()).jobs.add(job, holder, until)

    async def claim_job(self, holder: str, now: int, until: int) -> Job | None:
        """The oldest job that nobody holds at clock time `now`, held by this replica until `until`; None where there is
        none."""
        return await (await self.open()).jobs.claim(holder, now, until)

    async def hold_jobs(self, holder: str, until: int) -> None:
        """All jobs that a replica holds are held until clock time `until`."""
        await (await self.open()).jobs.hold(holder, until)

    async def remove_job(self, job: str) -> None:
        """A job is done, or given up."""
        await (await self.open()).jobs.remove(job)

    async def add_share(self, share: Share) -> None:
        """Add a link; those that have expired before it was created are removed."""
        await (await self.open()).shares.add(share)

    async def share(self, share: str) -> Share | None:
        """The link of this id, None where it was revoked."""
        return await (await self.open()).shares.get(share)

    async def shares(self, subject: str | None, limit: int) -> list[Share]:
        """At most `limit` links, newest first, of one subject or, for None, of all."""
        return await (await self.open()).shares.list(subject, limit)

    async def remove_share(self, share: str) -> bool:
        """Revoke a link; whether it was there."""
        return await (await self.open()).shares.remove(share)

    async def _open(self) -> SqlCatalogue:
        def load() -> type[SqlCatalogue]:
            from bunraku.backing.catalogue_sql import SqlCatalogue

            return SqlCatalogue

        return await (await asyncio.to_thread(load)).open(self._url)
