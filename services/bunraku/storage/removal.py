"""Removal of a motion: its row, then its object."""

from __future__ import annotations

from http import HTTPStatus

from bunraku.runtime.problem import ProblemError
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.motion_store import MotionStore


async def remove_motion(catalogue: Catalogue, motion_store: MotionStore, motion_id: str) -> bool:
    """Remove a motion and return whether it existed.

    If not even the removal of the row fits on a full disk, the object is removed first, which makes room for it.
    """
    try:
        existed = await catalogue.remove_motion(motion_id)
    except ProblemError as error:
        if error.status != HTTPStatus.INSUFFICIENT_STORAGE:
            raise
        await motion_store.remove(motion_id)
        existed = await catalogue.remove_motion(motion_id)
    if existed:
        await motion_store.remove(motion_id)
    return existed
