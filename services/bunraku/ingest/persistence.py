"""How what was made is kept: the object, then its row, within the quotas."""

from __future__ import annotations

from typing import Any

from bunraku.http.problem_details import ProblemError
from bunraku.ingest.result import JobResult
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import CatalogueEntry, QuotaExceeded


async def check_quota(backing: ServiceContext, subject: str) -> None:
    """Raise `ProblemError` where `subject` may not keep one more motion, before work is done for it."""
    quota = backing.settings.quota()
    if not any((quota.max_motions, quota.max_bytes, quota.max_total_motions, quota.max_total_bytes)):
        return
    try:
        await backing.catalogue.check_quota(subject, quota)
    except QuotaExceeded as error:
        raise _quota_problem(error) from None


async def store_motion(
    backing: ServiceContext, motion_id: str, result: JobResult, description: dict[str, Any], subject: str
) -> tuple[CatalogueEntry, bool]:
    """Keep what was made as `motion`, stored by `subject`, and whether it is new; raises `ProblemError`, with nothing
    kept, where a quota is used up."""
    entry = CatalogueEntry(motion_id, clock(), description, subject, len(result.packed))
    # the object first: a row always has its object, and an object without a row is harmless
    await backing.motion_store.put(motion_id, result.packed)
    try:
        new = await backing.catalogue.add_motion(entry, backing.settings.quota())
    except QuotaExceeded as error:
        if await backing.catalogue.get_motion(motion_id) is None:
            await backing.motion_store.remove(motion_id)
        raise _quota_problem(error) from None
    return (entry if new else (await backing.catalogue.get_motion(motion_id) or entry)), new


def _quota_problem(error: QuotaExceeded) -> ProblemError:
    return ProblemError(403, "Quota used up", str(error), hint="remove motions, or ask who runs this server")
