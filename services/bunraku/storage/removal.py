"""Removal of a motion: its object, then its row."""

from __future__ import annotations

from bunraku.storage.catalogue import Catalogue
from bunraku.storage.motion_store import MotionStore


async def remove_motion(catalogue: Catalogue, motion_store: MotionStore, motion_id: str) -> bool:
    """Remove a motion and return whether it existed.

    The object goes first. On a full disk this makes room for the removal of the row, and an upload of the same bytes
    that adds a new row afterwards finds the object gone, and stores it again.
    """
    if await catalogue.get_motion(motion_id) is not None:
        await motion_store.remove(motion_id)
    return await catalogue.remove_motion(motion_id)
