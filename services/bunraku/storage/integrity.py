"""Agreement between catalogue and object store: incomplete motions are hidden, unused objects are removed.

Neither is decided by an empty or foreign store alone. Rows are never removed, and a store whose objects mostly have no
row is left as it is: somebody may have mounted another folder, or restored an old catalogue.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable

from bunraku.storage.catalogue import Catalogue
from bunraku.storage.catalogue_sql import MotionKey
from bunraku.storage.motion_store import MotionStore, object_id
from bunraku.storage.object_folder import TEMPORARY_MARK, StoredObject

PAGE_SIZE = 500
"""Rows that are compared with their objects at a time."""
MAX_LOGGED_MOTIONS = 20
"""Incomplete motions that are named in the log, of each check."""
MAX_ORPHANED_SHARE = 0.5
"""Share of motion objects without a row above which none of them is removed."""
MIN_FOREIGN_OBJECTS = 20
"""Number of motion objects without a row from which `MAX_ORPHANED_SHARE` applies."""

UsedObjectFinder = Callable[[list[str]], Awaitable[set[str]]]
"""Function that returns those of the given ids that are in use."""

_log = logging.getLogger(__name__)


async def hide_incomplete_motions(catalogue: Catalogue, motion_store: MotionStore) -> int:
    """Hide the motions whose objects are missing or truncated; return their number.

    Raise `BackendUnavailable` or `ProblemError`, with nothing changed.
    """
    incomplete: list[MotionKey] = []
    after = ""
    while rows := await catalogue.list_motion_keys(PAGE_SIZE, after):
        after = rows[-1].id
        for row, size in zip(rows, await motion_store.object_sizes([row.id for row in rows]), strict=True):
            if size is not None and (not row.bytes or size == row.bytes or await _is_replaced(catalogue, row)):
                continue
            incomplete.append(row)
            if len(incomplete) <= MAX_LOGGED_MOTIONS:
                found = "is missing" if size is None else f"has {size} of {row.bytes} bytes"
                _log.warning("Motion %s is hidden: its object %s; restore it, or upload its file again", row.id, found)
    if len(incomplete) > MAX_LOGGED_MOTIONS:
        _log.warning("%d motions are hidden, as their objects are missing or truncated", len(incomplete))
    catalogue.hide_incomplete_motions(incomplete)
    return len(incomplete)


async def sweep_objects(catalogue: Catalogue, motion_store: MotionStore, created_before: float) -> int:
    """Remove objects that nothing refers to and that were last changed before a time; return their number.

    These are unfinished writes, session logs, uploaded files without a job and motions without a row. `created_before`
    is in seconds since 1970. Raise `BackendUnavailable` or `ProblemError`.
    """
    removed = 0
    finders: dict[str, UsedObjectFinder] = {
        "logs": _find_none,
        "sources": catalogue.find_jobs,
        "motions": catalogue.find_motions,
        "notes": _find_all,
    }
    for folder, find_used in finders.items():
        orphans: list[StoredObject] = []
        total = 0
        async for chunk in motion_store.list_objects(folder):
            total += len(chunk)
            orphans += await _find_orphans([one for one in chunk if one.modified < created_before], find_used)
        if folder == "motions" and len(orphans) >= MIN_FOREIGN_OBJECTS and len(orphans) > total * MAX_ORPHANED_SHARE:
            _log.error("%d of %d stored motions have no row in the catalogue; not removed", len(orphans), total)
            continue
        for one in orphans:
            await motion_store.remove_object(one.path)
        removed += len(orphans)
    if removed:
        _log.warning("Removed %d stored objects that ended processes left behind", removed)
    return removed


async def _is_replaced(catalogue: Catalogue, row: MotionKey) -> bool:
    """Return whether the object of a motion has been replaced since its row was read."""
    entry = await catalogue.get_motion(row.id)
    return entry is not None and entry.bytes != row.bytes


async def _find_orphans(objects: list[StoredObject], find_used: UsedObjectFinder) -> list[StoredObject]:
    """Return the unfinished writes among `objects`, and those that are not in use."""
    ids = {one.path: object_id(one.path) for one in objects if TEMPORARY_MARK not in one.path}
    used = await find_used(list(ids.values())) if ids else set()
    return [one for one in objects if ids.get(one.path) not in used]


async def _find_none(_: list[str]) -> set[str]:
    return set()


async def _find_all(ids: list[str]) -> set[str]:
    return set(ids)
