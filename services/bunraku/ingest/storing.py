"""How what was made is kept: the object, then its row, within the quotas."""

from __future__ import annotations

from typing import Any

from bunraku.backing.backing import Backing, clock
from bunraku.backing.catalogue import Entry, QuotaUsedUp
from bunraku.backing.problems import ProblemError
from bunraku.ingest.results import Made


async def check_room(backing: Backing, subject: str) -> None:
    """Raise `ProblemError` where `subject` may not keep one more motion, before work is done for it."""
    quota = backing.settings.quota()
    if not any((quota.motions, quota.bytes, quota.total_motions, quota.total_bytes)):
        return
    try:
        await backing.catalogue.check(subject, quota)
    except QuotaUsedUp as error:
        raise _used_up(error) from None


async def store(
    backing: Backing, motion: str, made: Made, described: dict[str, Any], subject: str
) -> tuple[Entry, bool]:
    """Keep what was made as `motion`, stored by `subject`, and whether it is new; raises `ProblemError`, with nothing
    kept, where a quota is used up."""
    entry = Entry(motion, clock(), described, subject, len(made.packed))
    # the object first: a row always has its object, and an object without a row is harmless
    await backing.library.put(motion, made.packed)
    try:
        new = await backing.catalogue.add(entry, backing.settings.quota())
    except QuotaUsedUp as error:
        if await backing.catalogue.get(motion) is None:
            await backing.library.remove(motion)
        raise _used_up(error) from None
    return (entry if new else (await backing.catalogue.get(motion) or entry)), new


def _used_up(error: QuotaUsedUp) -> ProblemError:
    return ProblemError(403, "Quota used up", str(error), hint="remove motions, or ask who runs this server")
