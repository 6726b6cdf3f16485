"""Encoded motions as objects: written once, never changed, in a folder or an object store by URL.

An object holds one motion whole: its Description and every Data message of every track and rate, ready to be sent.
Beside the motions lie what is about to become one, files that were sent and logs of sessions, each as long as that
takes, and notes of what replicas share.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Any

import msgpack

from bunraku.backing.objects import Objects
from bunraku.codec.audio import AudioTrack, EncodedAudio, read_audio
from bunraku.codec.encode import EncodedMotion
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.scene import SceneTrack, read_scene
from bunraku.codec.scene_encode import EncodedScene
from bunraku.codec.track import MotionTrack, read_track
from bunraku.motion.place import MIDDLE, Place
from bunraku.wire.limbs import MOST_PERFORMERS
from bunraku.wire.messages import Data, Description

CACHE_BYTES = 64 << 20
MOST_TRACKS = 16
"""Tracks that a Data message can number."""

Track = MotionTrack | SceneTrack | AudioTrack
_LOG_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True, slots=True)
class Dance:
    """What one performer dances: its track, the Data messages by rate, lowest first, and index, where it faces, radians
    about y from z towards x, and where on the stage it is danced."""

    track: MotionTrack
    packets: list[list[bytes]]
    front: float
    place: Place


@dataclass(frozen=True, slots=True)
class StoredMotion:
    """A motion as it is sent: the tracks of its Description, the performers' first, and `packets[track][rate][index]`,
    whole Data messages, lowest rate first; its `dances`, one for each performer; `kbps` what each rate of each track
    costs."""

    id: str
    description: bytes
    tracks: tuple[Track, ...]
    packets: list[list[list[bytes]]]
    dances: tuple[Dance, ...]
    kbps: tuple[tuple[float, ...], ...]

    @property
    def track(self) -> MotionTrack:
        """The first performer's track, whose length is the motion's."""
        return self.dances[0].track

    @property
    def dance(self) -> list[list[bytes]]:
        """The Data messages of the first performer's track, by rate and index."""
        return self.packets[0]

    @property
    def size(self) -> int:
        """Bytes of all messages."""
        packets = (packet for track in self.packets for rate in track for packet in rate)
        return len(self.description) + sum(map(len, packets))


def pack(
    motion: str, encoded: EncodedMotion, scenes: Sequence[EncodedScene] = (), others: Sequence[EncodedMotion] = ()
) -> bytes:
    """The object of an encoded motion, with the `others` who dance with it, and the cameras and lights that belong to
    it.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    tracks: list[EncodedMotion | EncodedScene] = [encoded, *others, *scenes]
    if len(tracks) > MOST_TRACKS:
        raise ValueError(f"a motion has at most {MOST_TRACKS} tracks, not {len(tracks)}")
    packets = [_messages(number, [rate.blocks for rate in track.rates]) for number, track in enumerate(tracks)]
    description = Description(motion, [track.describe() for track in tracks]).pack()
    packed: bytes = msgpack.packb({"description": description, "tracks": packets})
    return packed


def with_audio(motion: str, stored: StoredMotion, audio: EncodedAudio) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with its audio, which replaces what audio there was; and the types
    of its tracks. All other blocks are the same bytes.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    described = _described(stored)
    packets = list(stored.packets)
    number = next((n for n, track in enumerate(described) if track["type"] == "audio"), len(described))
    if number == MOST_TRACKS:
        raise ValueError(f"a motion has at most {MOST_TRACKS} tracks, and this one has them without audio")
    described[number:] = [audio.describe(), *described[number + 1 :]]
    packets[number:] = [_messages(number, [rate.blocks for rate in audio.rates]), *packets[number + 1 :]]
    packed: bytes = msgpack.packb({"description": Description(motion, described).pack(), "tracks": packets})
    return packed, [track["type"] for track in described]


def with_scenes(
    motion: str, stored: StoredMotion, scenes: Sequence[EncodedScene], replaced: Container[str]
) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with cameras and lights, in place of its tracks of the `replaced`
    types; and the types of its tracks. All other blocks are the same but for the number of their track.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    described = _described(stored)
    kept = [number for number, track in enumerate(described) if track["type"] not in replaced]
    if len(kept) + len(scenes) > MOST_TRACKS:
        raise ValueError(f"a motion has at most {MOST_TRACKS} tracks, and this would have {len(kept) + len(scenes)}")
    blocks = [[[Data.unpack(packet).block for packet in rate] for rate in stored.packets[number]] for number in kept]
    blocks += [[rate.blocks for rate in scene.rates] for scene in scenes]
    tracks = [*(described[number] for number in kept), *(scene.describe() for scene in scenes)]
    packets = [_messages(number, rates) for number, rates in enumerate(blocks)]
    packed: bytes = msgpack.packb({"description": Description(motion, tracks).pack(), "tracks": packets})
    return packed, [track["type"] for track in tracks]


def with_performers(
    motion: str, stored: StoredMotion, others: Sequence[StoredMotion], places: Sequence[Place]
) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with the performers of `others` beside its own, each at its place
    of `places`, in this order; and the types of its tracks. All blocks are the same but for the number of their track.

    Raises ValueError where there are more performers or tracks than can be numbered.
    """
    own = _described(stored)
    dancing = [(said, at) for said, at in zip(own, stored.packets, strict=True) if said["type"] == "motion"]
    beside = [(said, at) for said, at in zip(own, stored.packets, strict=True) if said["type"] != "motion"]
    for other in others:
        dancing += [
            (said, at) for said, at in zip(_described(other), other.packets, strict=True) if said["type"] == "motion"
        ]
    if len(dancing) > MOST_PERFORMERS:
        raise ValueError(f"a stage has at most {MOST_PERFORMERS} performers, and this would have {len(dancing)}")
    if len(dancing) + len(beside) > MOST_TRACKS:
        raise ValueError(f"a motion has at most {MOST_TRACKS} tracks, not {len(dancing) + len(beside)}")
    placed = [(said | {"place": list(place)}, at) for (said, at), place in zip(dancing, places, strict=True)]
    tracks = [said for said, _ in (*placed, *beside)]
    packets = [
        _messages(number, [[Data.unpack(packet).block for packet in rate] for rate in at])
        for number, (_, at) in enumerate((*placed, *beside))
    ]
    packed: bytes = msgpack.packb({"description": Description(motion, tracks).pack(), "tracks": packets})
    return packed, [track["type"] for track in tracks]


def _described(stored: StoredMotion) -> list[dict[str, Any]]:
    tracks: list[dict[str, Any]] = msgpack.unpackb(stored.description[1:])["tracks"]
    return tracks


def _messages(track: int, rates: Sequence[Sequence[bytes]]) -> list[list[bytes]]:
    """The Data messages of a track's blocks, by rate and index."""
    return [
        [Data(track, nth, index, block).pack() for index, block in enumerate(blocks)]
        for nth, blocks in enumerate(rates)
    ]


def unpack(motion: str, packed: bytes) -> StoredMotion:
    """The motion in an object that `pack` made; raises `DamagedBlock` where it is in a codec that is not spoken."""
    values = msgpack.unpackb(packed)
    described: list[dict[str, Any]] = msgpack.unpackb(values["description"][1:])["tracks"]
    # objects from when a motion was one track have its packets alone
    packets = values["tracks"] if "tracks" in values else [values["packets"]]
    dances = tuple(
        Dance(read_track(said), at, float(said.get("front", 0.0)), Place.read(said.get("place", MIDDLE)))
        for said, at in zip(described, packets, strict=True)
        if said["type"] == "motion"
    )
    first, beside = dances[0].track, described[len(dances) :]
    tracks: tuple[Track, ...] = (
        *(dance.track for dance in dances),
        *(read_audio(track, first) if track["type"] == "audio" else read_scene(track) for track in beside),
    )
    kbps = tuple(tuple(float(rate["kbps"]) for rate in track["rates"]) for track in described)
    return StoredMotion(motion, values["description"], tracks, packets, dances, kbps)


class Library:
    """The motions in an object store, those last used kept in memory. Methods raise `Unavailable` as `Objects` has it;
    what is in memory can be had without the store."""

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self._cache: OrderedDict[str, StoredMotion] = OrderedDict()
        self._cached = 0

    @classmethod
    def open(cls, url: str) -> Library:
        """The library at `file:///folder`, `s3://bucket/prefix` and what else obstore knows."""
        return cls(Objects(url))

    async def put(self, motion: str, packed: bytes) -> None:
        """Store the object that `pack` made."""
        await self._objects.put(_path(motion), packed)

    async def get(self, motion: str) -> StoredMotion | None:
        """The motion of this id, None where there is none in a codec that is spoken; what could not be an id is never a
        path."""
        if not (motion.isascii() and motion.isalnum()):
            return None
        if motion in self._cache:
            self._cache.move_to_end(motion)
            return self._cache[motion]
        packed = await self._objects.get(_path(motion))
        if packed is None:
            return None
        try:
            stored = unpack(motion, packed)
        except DamagedBlock:
            # of a codec that is no longer spoken: its file can be sent again
            return None
        self._keep(stored)
        return stored

    async def remove(self, motion: str) -> None:
        """Remove a motion's object; nothing happens where there is none."""
        dropped = self._cache.pop(motion, None)
        self._cached -= dropped.size if dropped else 0
        await self._objects.delete(_path(motion))

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
        if not _LOG_NAME.fullmatch(name):
            raise ValueError(f"a log's name is 1..64 of A-Z a-z 0-9 _ -, not {name[:80]!r}")
        await self._objects.put(_log_path(name), data)

    async def get_log(self, name: str) -> bytes | None:
        """The log of this name, None where there is none."""
        return await self._objects.get(_log_path(name)) if _LOG_NAME.fullmatch(name) else None

    async def remove_log(self, name: str) -> None:
        """Remove a log; nothing happens where there is none."""
        if _LOG_NAME.fullmatch(name):
            await self._objects.delete(_log_path(name))

    def _keep(self, stored: StoredMotion) -> None:
        if stored.id not in self._cache:
            self._cached += stored.size
        self._cache[stored.id] = stored
        while self._cached > CACHE_BYTES and len(self._cache) > 1:
            _, dropped = self._cache.popitem(last=False)
            self._cached -= dropped.size


def _path(motion: str) -> str:
    return f"motions/{motion}.bunraku"


def _log_path(name: str) -> str:
    return f"logs/{name}"
