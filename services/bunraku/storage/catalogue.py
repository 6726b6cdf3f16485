"""Catalogue of motions, props, viewer links and pending jobs, opened on first use."""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from typing import TYPE_CHECKING

from bunraku.storage.postgres_url import split_tls_options
from bunraku.storage.record import (
    CatalogueEntry,
    Job,
    JobHold,
    MotionFilter,
    PropQuota,
    Quota,
    Share,
    ShareScope,
    StoredProp,
)

if TYPE_CHECKING:
    from bunraku.storage.catalogue_sql import DescriptionEdit, MotionKey, SqlCatalogue

URL_SCHEMES = ("sqlite", "postgresql")


class Catalogue:
    """Catalogue at `sqlite:///path` or `postgresql://...`; raise ValueError for another URL.

    It opens on first use, or by `open`: importing SQLAlchemy takes seconds on a small machine, and a page can load
    without the catalogue. Every method raises `BackendUnavailable` while the database is unavailable.
    """

    def __init__(self, url: str) -> None:
        if url.split(":", 1)[0] not in URL_SCHEMES:
            # without the URL, which may contain a password
            raise ValueError("invalid catalogue URL, expected sqlite:///path or postgresql://host/name")
        if url.startswith("postgresql:"):
            split_tls_options(url)
        self._url = url
        self._open_task: asyncio.Task[SqlCatalogue] | None = None
        self._incomplete_motions: frozenset[tuple[str, int]] = frozenset()

    async def open(self) -> SqlCatalogue:
        """Open the database if needed and return its tables.

        Concurrent calls share one attempt; after a failure the next call tries again.
        """
        if self._open_task is None or (self._open_task.done() and self._open_task.exception() is not None):
            self._open_task = asyncio.create_task(self._open(), name="open the catalogue")
        return await asyncio.shield(self._open_task)

    async def close(self) -> None:
        """Close all connections."""
        if self._open_task is not None:
            await asyncio.wait((self._open_task,))
            if self._open_task.exception() is None:
                await self._open_task.result().close()

    async def add_motion(self, entry: CatalogueEntry, quota: Quota | None = None) -> bool:
        """Add a motion and return whether it is new; raise `QuotaExceeded`, with nothing added, beyond `quota`.

        It replaces a motion of the same id that is incomplete, and keeps its name and tags.
        """
        tables = await self.open()
        known = await tables.get_motion(entry.id) if self._incomplete_motions else None
        if known is not None and self._is_incomplete(known):
            entry = entry.with_edits_of(known)
            await tables.remove_motion(entry.id)
        return await tables.add_motion(entry, quota)

    async def check_quota(self, subject: str, quota: Quota) -> None:
        """Raise `QuotaExceeded` if `subject` cannot add even a small motion."""
        await (await self.open()).check_quota(subject, quota)

    async def get_motion(self, motion_id: str) -> CatalogueEntry | None:
        """Return a motion, None if it does not exist or is incomplete."""
        entry = await (await self.open()).get_motion(motion_id)
        return None if entry is None or self._is_incomplete(entry) else entry

    async def list_motions(
        self, limit: int, cursor: str | None = None, condition: MotionFilter | None = None
    ) -> tuple[list[CatalogueEntry], str | None]:
        """Return at most `limit` motions, newest first, and the next page's cursor; raise `InvalidCursor`.

        A page has fewer motions if some of them are incomplete.
        """
        entries, following = await (await self.open()).list_motions(limit, cursor, condition or MotionFilter())
        return [entry for entry in entries if not self._is_incomplete(entry)], following

    async def edit_motion(
        self, motion_id: str, edit: DescriptionEdit, object_bytes: int | None = None
    ) -> CatalogueEntry | None:
        """Replace the description of a motion by what `edit` returns for its entry; return the new entry.

        `object_bytes` is the new size of its object, 0 while that is unknown; None keeps it. Return None if the motion
        does not exist or is incomplete. Concurrent edits follow one another.
        """
        if await self.get_motion(motion_id) is None:
            return None
        return await (await self.open()).edit_motion(motion_id, edit, object_bytes)

    async def remove_motion(self, motion_id: str) -> bool:
        """Remove a motion and return whether it existed."""
        return await (await self.open()).remove_motion(motion_id)

    async def list_motion_keys(self, limit: int, after: str = "") -> list[MotionKey]:
        """Return at most `limit` motions with ids greater than `after`, by id, including incomplete ones."""
        return await (await self.open()).list_motion_keys(limit, after)

    def hide_incomplete_motions(self, keys: Collection[MotionKey]) -> None:
        """Hide the motions whose objects are missing or truncated, and no others, on this replica.

        Their rows stay: the objects may be on a file system that is not mounted. A row that is stored again has another
        time of creation and is not hidden.
        """
        self._incomplete_motions = frozenset((key.id, key.created) for key in keys)

    async def find_motions(self, ids: list[str]) -> set[str]:
        """Return those of `ids` that are motions, including incomplete ones."""
        return await (await self.open()).find_motions(ids)

    async def find_jobs(self, ids: list[str]) -> set[str]:
        """Return those of `ids` that are pending jobs."""
        return await (await self.open()).find_jobs(ids)

    async def restore_reserve(self) -> None:
        """Reserve space for removals again, if there is room for it."""
        reserve = (await self.open()).reserve
        if reserve is not None:
            await asyncio.to_thread(reserve.restore)

    async def add_job(self, job: Job, holder: str, held_until: int) -> None:
        """Add a job, held by the replica `holder` until clock time `held_until`; take over a job of the same id."""
        await (await self.open()).jobs.add(job, holder, held_until)

    async def list_job_holds(self, limit: int) -> dict[str, JobHold]:
        """Return who holds the `limit` oldest jobs, by id, oldest first."""
        return await (await self.open()).jobs.list_holds(limit)

    async def claim_job(self, job_id: str, hold: JobHold, holder: str, held_until: int) -> Job | None:
        """Claim a job that still has the hold `hold`; return None if another replica was faster."""
        return await (await self.open()).jobs.claim(job_id, hold, holder, held_until)

    async def renew_jobs(self, holder: str, held_until: int) -> None:
        """Hold all jobs of a replica until clock time `held_until`."""
        await (await self.open()).jobs.renew(holder, held_until)

    async def remove_job(self, job_id: str) -> None:
        """Remove a job that is complete or given up."""
        await (await self.open()).jobs.remove(job_id)

    async def add_prop(self, prop: StoredProp, model: bytes, quota: PropQuota) -> bool:
        """Add a prop and its model, and return whether it is new; raise `QuotaExceeded`, with nothing added."""
        return await (await self.open()).props.add(prop, model, quota)

    async def check_prop_quota(self, subject: str, quota: PropQuota) -> None:
        """Raise `QuotaExceeded` if `subject` cannot add one more prop."""
        await (await self.open()).props.check_quota(subject, quota)

    async def get_prop(self, prop_id: str) -> StoredProp | None:
        """Return a prop, None if it does not exist."""
        return await (await self.open()).props.get(prop_id)

    async def get_prop_model(self, prop_id: str) -> bytes | None:
        """Return the model of a prop, None if it does not exist."""
        return await (await self.open()).props.get_model(prop_id)

    async def list_props(self, limit: int, cursor: str | None = None) -> tuple[list[StoredProp], str | None]:
        """Return at most `limit` props, newest first, and the next page's cursor; raise `InvalidCursor`."""
        return await (await self.open()).props.list(limit, cursor)

    async def remove_prop(self, prop_id: str) -> bool:
        """Remove a prop and return whether it existed."""
        return await (await self.open()).props.remove(prop_id)

    async def add_share(self, share: Share, max_per_subject: int = 0) -> None:
        """Add a viewer link and remove those that expired before it was created.

        Raise `QuotaExceeded`, with nothing added, if its subject has `max_per_subject` links; 0 is unlimited.
        """
        await (await self.open()).shares.add(share, max_per_subject)

    async def get_share(self, share_id: str) -> Share | None:
        """Return a viewer link, None if it was revoked."""
        return await (await self.open()).shares.get(share_id)

    async def list_shares(self, scope: ShareScope, limit: int) -> list[Share]:
        """Return at most `limit` viewer links of a scope, newest first."""
        return await (await self.open()).shares.list(scope, limit)

    async def remove_share(self, share_id: str) -> bool:
        """Revoke a viewer link and return whether it existed."""
        return await (await self.open()).shares.remove(share_id)

    def _is_incomplete(self, entry: CatalogueEntry) -> bool:
        return (entry.id, entry.created) in self._incomplete_motions

    async def _open(self) -> SqlCatalogue:
        def import_class() -> type[SqlCatalogue]:
            from bunraku.storage.catalogue_sql import SqlCatalogue

            return SqlCatalogue

        return await (await asyncio.to_thread(import_class)).open(self._url)
