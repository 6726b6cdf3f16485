"""Storage of finished motions within the quotas: first the object, then its catalogue entry."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from bunraku.http.problem_details import motion_not_found
from bunraku.ingest.result import JobResult
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import CatalogueEntry, QuotaExceeded


class StoreOutcome(NamedTuple):
    """A stored motion, and whether this operation created it."""

    entry: CatalogueEntry
    is_new: bool


async def check_quota(context: ServiceContext, subject: str) -> None:
    """Raise `ProblemError` (403) before any work if `subject` cannot store one more motion."""
    quota = context.settings.quota()
    if not any((quota.max_motions, quota.max_bytes, quota.max_total_motions, quota.max_total_bytes)):
        return
    try:
        await context.catalogue.check_quota(subject, quota)
    except QuotaExceeded as error:
        raise quota_problem(error) from None


async def store_motion(
    context: ServiceContext,
    motion_id: str,
    result: JobResult,
    description: dict[str, Any],
    subject: str,
    replaced: CatalogueEntry | None = None,
) -> StoreOutcome:
    """Store a motion for `subject`; raise `ProblemError` (403), with nothing stored, if a quota is used up.

    If an entry of this id exists, it stays unchanged and is returned. `replaced` is one whose object is missing or in a
    codec of an older release: it is removed, and its subject keeps the name and tags.
    """
    entry = CatalogueEntry(motion_id, context.clock(), description, subject, len(result.packed))
    if replaced is not None:
        entry = entry.with_edits_of(replaced)
        await context.catalogue.remove_motion(motion_id)
    # the object first: every entry then has its object, and an object without an entry is harmless
    await context.motion_store.put(motion_id, result.packed)
    try:
        is_new = await context.catalogue.add_motion(entry, context.settings.quota())
    except QuotaExceeded as error:
        if await context.catalogue.get_motion(motion_id) is None:
            await context.motion_store.remove(motion_id)
        raise quota_problem(error) from None
    if is_new and (await context.motion_store.object_sizes([motion_id]))[0] is None:
        # a removal of the same motion at the same time has taken the object, and then the row that was there
        await context.motion_store.put(motion_id, result.packed)
    # an existing entry, or the labels of an incomplete one
    return StoreOutcome(await context.catalogue.get_motion(motion_id) or entry, is_new)


async def replace_motion(
    context: ServiceContext, motion_id: str, packed: bytes, describe: Callable[[dict[str, Any]], dict[str, Any]]
) -> CatalogueEntry:
    """Replace the object of a motion, and its description by what `describe` returns; return the new entry.

    Whatever is interrupted, the motion stays complete. Raise `ProblemError` (404), with nothing stored, if it was
    removed.
    """
    catalogue, store = context.catalogue, context.motion_store
    # of an object with an unknown size nobody thinks that it is truncated
    if await catalogue.edit_motion(motion_id, lambda entry: entry.description, object_bytes=0) is None:
        raise motion_not_found(motion_id)
    await store.put(motion_id, packed)
    entry = await catalogue.edit_motion(motion_id, lambda entry: describe(entry.description), object_bytes=len(packed))
    if entry is None:
        await store.remove(motion_id)
        raise motion_not_found(motion_id)
    return entry


def quota_problem(error: QuotaExceeded, things: str = "motions") -> ProblemError:
    """Return the problem (403) of a quota of `things`."""
    hint = f"remove {things}, or ask the operator for a higher quota"
    return ProblemError(403, "Quota used up", str(error), hint=hint)
