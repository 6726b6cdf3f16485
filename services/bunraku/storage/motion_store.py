"""Encoded motions as objects: written once, never changed, in a folder or an object store by URL.

Beside the motions lie uploaded files and session logs that jobs still need, each for as long as its job takes, and
notes that replicas share.
"""

from __future__ import annotations

import re
from collections import OrderedDict

from bunraku.codec.container import StoredMotion, unpack_motion
from bunraku.codec.errors import DamagedBlock
from bunraku.storage.object_storage import ObjectStorage

MAX_CACHE_BYTES = 64 << 20
_LOG_NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")


class MotionStore:
    """The motions in an object store, those last used kept in memory. Methods raise `Unavailable` as `Objects` has it;
    what is in memory can be had without the store."""

    def __init__(self, objects: ObjectStorage) -> None:
        self._objects = objects
        self._cache: OrderedDict[str, StoredMotion] = OrderedDict()
        self._cached_bytes = 0

    @classmethod
    def open(cls, url: str) -> MotionStore:
        """The library at `file:///folder`, `s3://bucket/prefix` and what else obstore knows."""
        return cls(ObjectStorage(url))

    async def put(self, motion_id: str, packed: bytes) -> None:
        """Store the object that `pack_motion` made."""
        await self._objects.put(_motion_path(motion_id), packed)

    async def get(self, motion_id: str) -> StoredMotion | None:
        """The motion of this id, None where there is none in a codec that is spoken; what could not be an id is never a
        path."""
        if not (motion_id.isascii() and motion_id.isalnum()):
            return None
        if motion_id in self._cache:
            self._cache.move_to_end(motion_id)
            return self._cache[motion_id]
        packed = await self._objects.get(_motion_path(motion_id))
        if packed is None:
            return None
        try:
            stored = unpack_motion(motion_id, packed)
        except DamagedBlock:
            # of a codec that is no longer spoken: its file can be sent again
            return None
        self._cache_motion(stored)
        return stored

    async def remove(self, motion_id: str) -> None:
        """Remove a motion's object; nothing happens where there is none."""
        dropped = self._cache.pop(motion_id, None)
        self._cached_bytes -= dropped.total_bytes if dropped else 0
        await self._objects.delete(_motion_path(motion_id))

    async def check(self) -> None:
        """Raises `Unavailable` where the store cannot be used now."""
        await self._objects.check()

    async def put_note(self, name: str, data: bytes) -> None:
        """Store a note under a name that the code gives it, a word."""
        await self._objects.put(f"notes/{name}", data)

    async def get_note(self, name: str) -> bytes | None:
        """The note of this name, None where there is none."""
        return await self._objects.get(f"notes/{name}")

    async def put_source(self, name: str, data: bytes) -> None:
        """Store a file that was sent, under a name that the code gives it, a word."""
        await self._objects.put(f"sources/{name}", data)

    async def get_source(self, name: str) -> bytes | None:
        """The file of this name, None where there is none."""
        return await self._objects.get(f"sources/{name}")

    async def remove_source(self, name: str) -> None:
        """Remove a file that was sent; nothing happens where there is none."""
        await self._objects.delete(f"sources/{name}")

    async def put_log(self, name: str, data: bytes) -> None:
        """Store a session's log under a random name of 1..64 of A-Z a-z 0-9 _ -; raises ValueError for another."""
        if not _LOG_NAME_PATTERN.fullmatch(name):
            raise ValueError(f"a log's name is 1..64 of A-Z a-z 0-9 _ -, not {name[:80]!r}")
        await self._objects.put(_log_path(name), data)

    async def get_log(self, name: str) -> bytes | None:
        """The log of this name, None where there is none."""
        return await self._objects.get(_log_path(name)) if _LOG_NAME_PATTERN.fullmatch(name) else None

    async def remove_log(self, name: str) -> None:
        """Remove a log; nothing happens where there is none."""
        if _LOG_NAME_PATTERN.fullmatch(name):
            await self._objects.delete(_log_path(name))

    def _cache_motion(self, stored: StoredMotion) -> None:
        if stored.id not in self._cache:
            self._cached_bytes += stored.total_bytes
        self._cache[stored.id] = stored
        while self._cached_bytes > MAX_CACHE_BYTES and len(self._cache) > 1:
            _, dropped = self._cache.popitem(last=False)
            self._cached_bytes -= dropped.total_bytes


def _motion_path(motion_id: str) -> str:
    return f"motions/{motion_id}.bunraku"


def _log_path(name: str) -> str:
    return f"logs/{name}"
