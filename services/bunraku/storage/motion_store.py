"""Store of encoded motions: objects in a folder or an object store, which change only when they are encoded again.

The store also holds the uploaded files and session logs of pending jobs, the samples of live performances, and notes
that replicas share.
"""

from __future__ import annotations

import logging
import re
from collections import OrderedDict
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from weakref import WeakValueDictionary

from bunraku.codec.container import StoredMotion, unpack_motion
from bunraku.codec.errors import DamagedBlock
from bunraku.runtime.clock import clock
from bunraku.storage.object_folder import StoredObject
from bunraku.storage.object_storage import ObjectStorage
from bunraku.storage.performance_store import PerformanceStore
from bunraku.storage.record import is_motion_id

MAX_CACHE_BYTES = 64 << 20
"""Limit of the messages of cached motions. Parsed motions of a few seconds take twice the memory of their messages."""
MAX_CACHE_IDLE_US = 600_000_000
"""Time after its last request until a motion leaves the cache, microseconds. Without it the cache grows for days on a
server on which each motion is requested a few times: 100 motions of 2 s take 1.3 MB."""
OBJECT_FOLDERS = ("motions", "sources", "logs", "performances", "notes")
_MOTION_SUFFIX = ".bunraku"
_LOG_NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")

_log = logging.getLogger(__name__)


class MotionStore:
    """Motions in an object store, with a cache of the most recently used ones.

    Methods raise `BackendUnavailable` as `ObjectStorage` does; cached motions are served without the store.
    """

    def __init__(self, objects: ObjectStorage, clock: Callable[[], int] = clock) -> None:
        self._objects = objects
        self._clock = clock
        # all motions in use, so that none is in memory twice
        self._loaded: WeakValueDictionary[str, StoredMotion] = WeakValueDictionary()
        # cached motions and the times of their last requests, the oldest first
        self._cache: OrderedDict[str, tuple[StoredMotion, int]] = OrderedDict()
        self._cached_bytes = 0
        self.performances = PerformanceStore(objects)

    @classmethod
    def open(cls, url: str) -> MotionStore:
        """Open the store at `file:///folder`, `s3://bucket/prefix` or another URL that obstore supports."""
        return cls(ObjectStorage(url))

    async def put(self, motion_id: str, packed: bytes) -> None:
        """Store a motion, packed by `pack_motion`. Who has loaded a former object of this id keeps it."""
        await self._objects.put(_motion_path(motion_id), packed)
        self._forget(motion_id)

    async def get(self, motion_id: str) -> StoredMotion | None:
        """Return a motion, None if it does not exist, is damaged or is in an unsupported codec."""
        # never use a string as a path that cannot be an id
        if not is_motion_id(motion_id):
            return None
        if (loaded := self._loaded.get(motion_id)) is not None:
            self._cache_motion(loaded)
            return loaded
        packed = await self._objects.get(_motion_path(motion_id))
        if packed is None:
            return None
        try:
            stored = unpack_motion(motion_id, packed)
        except DamagedBlock:
            # a codec of an older release: the file can be uploaded again
            return None
        except (ValueError, LookupError, TypeError) as error:
            _log.warning("The object of motion %s is damaged: %s; upload its file again", motion_id, error)
            return None
        # another request may have loaded it meanwhile
        stored = self._loaded.setdefault(motion_id, stored)
        self._cache_motion(stored)
        return stored

    async def touch(self, motion_id: str) -> None:
        """Store a motion again, if it exists: one that is not in the library is removed when it is old."""
        packed = await self._objects.get(_motion_path(motion_id))
        if packed is not None:
            await self._objects.put(_motion_path(motion_id), packed)

    async def remove(self, motion_id: str) -> None:
        """Remove a motion if it exists."""
        self._forget(motion_id)
        await self._objects.delete(_motion_path(motion_id))

    async def check(self) -> None:
        """Raise `BackendUnavailable` if the store cannot be used now."""
        await self._objects.check()

    async def put_note(self, name: str, data: bytes) -> None:
        """Store a note; `name` is a constant of the code, one word."""
        await self._objects.put(f"notes/{name}", data)

    async def get_note(self, name: str) -> bytes | None:
        """Return a note, None if it does not exist."""
        return await self._objects.get(f"notes/{name}")

    async def put_source(self, name: str, source: Path) -> None:
        """Store an uploaded file; `name` is derived from its hash, one word."""
        await self._objects.put_file(f"sources/{name}", source)

    async def copy_source(self, name: str, target: Path) -> bool:
        """Write an uploaded file to the file `target`; return whether it is stored."""
        return await self._objects.copy(f"sources/{name}", target)

    async def remove_source(self, name: str) -> None:
        """Remove an uploaded file if it exists."""
        await self._objects.delete(f"sources/{name}")

    async def put_log(self, name: str, data: bytes) -> None:
        """Store a session log; raise ValueError unless `name` is 1 to 64 characters of A-Z a-z 0-9 _ -."""
        if not _LOG_NAME_PATTERN.fullmatch(name):
            raise ValueError(f"invalid log name {name[:80]!r}, expected 1 to 64 characters of A-Z a-z 0-9 _ -")
        await self._objects.put(_log_path(name), data)

    async def get_log(self, name: str) -> bytes | None:
        """Return a session log, None if it does not exist."""
        return await self._objects.get(_log_path(name)) if _LOG_NAME_PATTERN.fullmatch(name) else None

    async def remove_log(self, name: str) -> None:
        """Remove a session log if it exists."""
        if _LOG_NAME_PATTERN.fullmatch(name):
            await self._objects.delete(_log_path(name))

    async def object_sizes(self, motion_ids: list[str]) -> list[int | None]:
        """Return the sizes of the objects of motions in bytes, None for those that do not exist."""
        return await self._objects.sizes([_motion_path(motion_id) for motion_id in motion_ids])

    def list_objects(self, folder: str) -> AsyncIterator[list[StoredObject]]:
        """Return the objects of one of `OBJECT_FOLDERS`, in chunks."""
        return self._objects.list_chunks(folder)

    async def remove_object(self, path: str) -> None:
        """Remove an object that `list_objects` returned."""
        await self._objects.delete(path)

    def _cache_motion(self, stored: StoredMotion) -> None:
        """Cache a motion that is requested now, and drop those beyond the limits."""
        now = self._clock()
        if stored.id not in self._cache:
            self._cached_bytes += stored.total_bytes
        self._cache[stored.id] = stored, now
        self._cache.move_to_end(stored.id)
        while len(self._cache) > 1:
            oldest, (_, requested_at) = next(iter(self._cache.items()))
            if self._cached_bytes <= MAX_CACHE_BYTES and requested_at >= now - MAX_CACHE_IDLE_US:
                break
            self._drop(oldest)

    def _forget(self, motion_id: str) -> None:
        self._loaded.pop(motion_id, None)
        if motion_id in self._cache:
            self._drop(motion_id)

    def _drop(self, motion_id: str) -> None:
        dropped, _ = self._cache.pop(motion_id)
        self._cached_bytes -= dropped.total_bytes


def object_id(path: str) -> str:
    """Return the id of the motion or job, or the name of the log or note, whose object is at `path`."""
    return path.rpartition("/")[2].removesuffix(_MOTION_SUFFIX)


def _motion_path(motion_id: str) -> str:
    return f"motions/{motion_id}{_MOTION_SUFFIX}"


def _log_path(name: str) -> str:
    return f"logs/{name}"
