"""Samples of live performances, stored every second until the performance has become a motion.

A performance has a header, which says what to make of it, and parts with some samples each. Parts are named by the
connection that received them, so that no two replicas write the same one.
"""

from __future__ import annotations

import asyncio
import re
from dataclasses import dataclass, field

import msgpack
import numpy as np

from bunraku.motion.skeleton import JOINT_COUNT, Figure
from bunraku.storage.motion_id import derive_digest, derive_motion_id
from bunraku.storage.object_folder import TEMPORARY_MARK
from bunraku.storage.object_storage import ObjectStorage

FOLDER = "performances"
MAX_DURATION_US = 3_600_000_000
"""Time from the creation of a performer after which samples are not stored, and its motion ends."""
MAX_CONCURRENT_READS = 16
"""Parts that are read at the same time."""
_HEADER_PART = "header"
_ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True, slots=True)
class PerformanceHeader:
    """What to make of the samples of a performer: a motion of a figure at `fps` frames per second."""

    id: str
    """Id of the performer."""
    name: str
    fps: float
    figure: Figure
    created_us: int
    """Clock time of the creation."""
    subject: str = ""
    """Subject that stores the motion."""

    @property
    def motion(self) -> str:
        """Id of the motion."""
        return derive_motion_id(derive_digest(self.id, b" performed live"))

    def pack(self) -> bytes:
        """Return the header as MessagePack."""
        lengths = [part.astype("<f8").tobytes() for part in (self.figure.offsets, self.figure.tips)]
        packed: bytes = msgpack.packb([self.id, self.name, self.fps, self.created_us, self.subject, *lengths])
        return packed

    @classmethod
    def unpack(cls, data: bytes) -> PerformanceHeader:
        """Parse a header; raise ValueError."""
        try:
            performer, name, fps, created_us, subject, *lengths = msgpack.unpackb(data)[:7]
            offsets, tips = (np.frombuffer(part, "<f8").reshape(JOINT_COUNT, 3).copy() for part in lengths)
        except (TypeError, msgpack.UnpackException) as error:
            raise ValueError(f"not the header of a performance: {error}") from None
        return cls(performer, name, fps, Figure(offsets, tips), created_us, subject)


@dataclass(slots=True)
class StoredPerformance:
    """Objects of one performance, and the time of the last change, in seconds since 1970."""

    parts: list[str] = field(default_factory=list)
    modified: float = 0.0


class PerformanceStore:
    """Performances in an object store. Methods raise `BackendUnavailable` as `ObjectStorage` does."""

    def __init__(self, objects: ObjectStorage) -> None:
        self._objects = objects

    async def put_header(self, header: PerformanceHeader) -> None:
        """Store the header, again while the performance goes on: it is abandoned when nothing changes any more."""
        await self._objects.put(_path(header.id, _HEADER_PART), header.pack())

    async def get_header(self, performer: str) -> PerformanceHeader | None:
        """Return the header of a performance; None if it is unknown or has ended."""
        packed = await self._objects.get(_path(performer, _HEADER_PART)) if _ID_PATTERN.fullmatch(performer) else None
        return None if packed is None else PerformanceHeader.unpack(packed)

    async def remove_header(self, performer: str) -> None:
        """Remove the header of a performance without samples."""
        await self._objects.delete(_path(performer, _HEADER_PART))

    async def put_part(self, performer: str, name: str, samples: bytes) -> None:
        """Store samples under a `name` that no other part has: letters, digits and `-`."""
        await self._objects.put(_path(performer, name), samples)

    async def list_performances(self) -> dict[str, StoredPerformance]:
        """Return all performances by the id of the performer."""
        found: dict[str, StoredPerformance] = {}
        async for chunk in self._objects.list_chunks(FOLDER):
            for one in chunk:
                performer, _, part = one.path.rpartition("/")[2].partition(".")
                if part and TEMPORARY_MARK not in one.path:
                    performance = found.setdefault(performer, StoredPerformance())
                    performance.parts.append(part)
                    performance.modified = max(performance.modified, one.modified)
        return found

    async def load(self, performer: str, performance: StoredPerformance) -> list[bytes]:
        """Return the parts of a performance."""
        slots = asyncio.Semaphore(MAX_CONCURRENT_READS)

        async def read(part: str) -> bytes:
            async with slots:
                return await self._objects.get(_path(performer, part)) or b""

        names = sorted(part for part in performance.parts if part != _HEADER_PART)
        return await asyncio.gather(*map(read, names))

    async def remove(self, performer: str, performance: StoredPerformance) -> None:
        """Remove a performance, its header last."""
        for part in sorted(performance.parts, key=lambda part: part == _HEADER_PART):
            await self._objects.delete(_path(performer, part))


def _path(performer: str, part: str) -> str:
    return f"{FOLDER}/{performer}.{part}"
