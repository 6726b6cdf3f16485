"""What motions there are, what links for viewers, and the jobs of which there will be more motions: one row each."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bunraku.storage.catalogue_sql import SqlCatalogue

URL_SCHEMES = ("sqlite", "postgresql")


class InvalidCursor(ValueError):
    """A cursor that this catalogue did not give."""


class QuotaExceeded(Exception):
    """One motion more than may be kept; the text says of what there is too much."""


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
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

    max_motions: int = 0
    max_bytes: int = 0
    max_total_motions: int = 0
    max_total_bytes: int = 0


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
        if url.split(":", 1)[0] not in URL_SCHEMES:
            raise ValueError(f"a catalogue is at sqlite:///path or postgresql://host/name, not {url!r}")
        self._url = url
        self._open_task: asyncio.Task[SqlCatalogue] | None = None

    async def open(self) -> SqlCatalogue:
        """The catalogue itself; who comes second waits for the first. After a failure the next call tries again."""
        if self._open_task is None or (self._open_task.done() and self._open_task.exception() is not None):
            self._open_task = asyncio.create_task(self._open(), name="open the catalogue")
        return await asyncio.shield(self._open_task)

    async def close(self) -> None:
        """Close every connection."""
        if self._open_task is not None:
            await asyncio.wait((self._open_task,))
            if self._open_task.exception() is None:
                await self._open_task.result().close()

    async def add_motion(self, entry: CatalogueEntry, quota: Quota | None = None) -> bool:
        """Add a motion; whether it was new. Raises `QuotaUsedUp` where it is one too many, and nothing is added."""
        return await (await self.open()).add_motion(entry, quota)

    async def check_quota(self, subject: str, quota: Quota) -> None:
        """Whether `subject` may add one more motion, if it is small; raises `QuotaUsedUp`."""
        await (await self.open()).check_quota(subject, quota)

    async def get_motion(self, motion_id: str) -> CatalogueEntry | None:
        """The motion of this id."""
        return await (await self.open()).get_motion(motion_id)

    async def list_motions(self, limit: int, cursor: str | None = None) -> tuple[list[CatalogueEntry], str | None]:
        """At most `limit` motions, newest first, and the cursor of the next page; raises `BadCursor`."""
        return await (await self.open()).list_motions(limit, cursor)

    async def remove_motion(self, motion_id: str) -> bool:
        """Remove a motion; whether it was there."""
        return await (await self.open()).remove_motion(motion_id)

    async def add_job(self, job: Job, holder: str, held_until: int) -> None:
        """Add a job, held by a replica until clock time `until`; one of the same id is taken over."""
        await (await self.open()).jobs.add(job, holder, held_until)

    async def claim_job(self, holder: str, now: int, held_until: int) -> Job | None:
        """The oldest job that nobody holds at clock time `now`, held by this replica until `until`; None where there is
        none."""
        return await (await self.open()).jobs.claim(holder, now, held_until)

    async def renew_jobs(self, holder: str, held_until: int) -> None:
        """All jobs that a replica holds are held until clock time `until`."""
        await (await self.open()).jobs.renew(holder, held_until)

    async def remove_job(self, job_id: str) -> None:
        """A job is done, or given up."""
        await (await self.open()).jobs.remove(job_id)

    async def add_share(self, share: Share) -> None:
        """Add a link; those that have expired before it was created are removed."""
        await (await self.open()).shares.add(share)

    async def get_share(self, share_id: str) -> Share | None:
        """The link of this id, None where it was revoked."""
        return await (await self.open()).shares.get(share_id)

    async def list_shares(self, subject: str | None, limit: int) -> list[Share]:
        """At most `limit` links, newest first, of one subject or, for None, of all."""
        return await (await self.open()).shares.list(subject, limit)

    async def remove_share(self, share_id: str) -> bool:
        """Revoke a link; whether it was there."""
        return await (await self.open()).shares.remove(share_id)

    async def _open(self) -> SqlCatalogue:
        def load() -> type[SqlCatalogue]:
            from bunraku.storage.catalogue_sql import SqlCatalogue

            return SqlCatalogue

        return await (await asyncio.to_thread(load)).open(self._url)
