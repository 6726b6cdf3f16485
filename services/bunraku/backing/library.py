"""Encoded motions as objects: written once, never changed, in a folder or an object store by URL.

An object holds one motion whole: its Description and every Data message of every rate, ready to be sent.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import msgpack
import obstore
from obstore.store import LocalStore, ObjectStore, from_url

from bunraku.codec.encode import EncodedMotion
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.track import MotionTrack, read_track
from bunraku.wire.messages import Data, Description

CACHE_BYTES = 64 << 20


@dataclass(frozen=True, slots=True)
class StoredMotion:
    """A motion as it is sent: `packets[rate][index]` are whole Data messages, lowest rate first."""

    id: str
    description: bytes
    packets: list[list[bytes]]
    track: MotionTrack

    @property
    def size(self) -> int:
        """Bytes of all messages."""
        return len(self.description) + sum(len(packet) for rate in self.packets for packet in rate)


def pack(motion: str, encoded: EncodedMotion) -> bytes:
    """The object of an encoded motion."""
    packets = [
        [Data(0, number, index, block).pack() for index, block in enumerate(rate.blocks)]
        for number, rate in enumerate(encoded.rates)
    ]
    description = Description(motion, [encoded.describe()]).pack()
    packed: bytes = msgpack.packb({"description": description, "packets": packets})
    return packed


class Library:
    """The motions in an object store, those last used kept in memory."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        self._cache: OrderedDict[str, StoredMotion] = OrderedDict()
        self._cached = 0

    @classmethod
    def open(cls, url: str) -> Library:
        """The library at `file:///folder`, `s3://bucket/prefix` and what else obstore knows."""
        if url.startswith("file://"):
            return cls(LocalStore(url.removeprefix("file://"), mkdir=True))
        return cls(from_url(url))

    async def put(self, motion: str, packed: bytes) -> None:
        """Store the object that `pack` made."""
        await obstore.put_async(self._store, _path(motion), packed)

    async def get(self, motion: str) -> StoredMotion | None:
        """The motion of this id, None where there is none in a codec that is spoken; what could not be an id is never a
        path."""
        if not (motion.isascii() and motion.isalnum()):
            return None
        if motion in self._cache:
            self._cache.move_to_end(motion)
            return self._cache[motion]
        try:
            found = await obstore.get_async(self._store, _path(motion))
            values = msgpack.unpackb(bytes(await found.bytes_async()))
        except FileNotFoundError:
            return None
        track = msgpack.unpackb(values["description"][1:])["tracks"][0]
        try:
            stored = StoredMotion(motion, values["description"], values["packets"], read_track(track))
        except DamagedBlock:
            # of a codec that is no longer spoken: its file can be sent again
            return None
        self._keep(stored)
        return stored

    async def remove(self, motion: str) -> None:
        """Remove a motion's object; nothing happens where there is none."""
        dropped = self._cache.pop(motion, None)
        self._cached -= dropped.size if dropped else 0
        try:
            await obstore.delete_async(self._store, _path(motion))
        except FileNotFoundError:
            return

    def _keep(self, stored: StoredMotion) -> None:
        if stored.id not in self._cache:
            self._cached += stored.size
        self._cache[stored.id] = stored
        while self._cached > CACHE_BYTES and len(self._cache) > 1:
            _, dropped = self._cache.popitem(last=False)
            self._cached -= dropped.size


def _path(motion: str) -> str:
    return f"motions/{motion}.bunraku"
