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

from bunraku.codec.audio import AudioTrack, EncodedAudio, parse_audio_track
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.motion_encoder import EncodedMotion
from bunraku.codec.motion_track import MotionTrack, parse_motion_track
from bunraku.codec.scene import SceneTrack, parse_scene_track
from bunraku.codec.scene_encoder import EncodedScene
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.storage.object_storage import ObjectStorage
from bunraku.wire.limbs import MAX_PERFORMERS
from bunraku.wire.messages import Data, Description

MAX_CACHE_BYTES = 64 << 20
MAX_TRACKS = 16
"""Tracks that a Data message can number."""

Track = MotionTrack | SceneTrack | AudioTrack
_LOG_NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True, slots=True)
class PerformerTracks:
    """What one performer dances: its track, the Data messages by rate, lowest first, and index, where it faces, radians
    about y from z towards x, and where on the stage it is danced."""

    track: MotionTrack
    packets: list[list[bytes]]
    front: float
    placement: Placement


@dataclass(frozen=True, slots=True)
class StoredMotion:
    """A motion as it is sent: the tracks of its Description, the performers' first, and `packets[track][rate][index]`,
    whole Data messages, lowest rate first; its `dances`, one for each performer; `kbps` what each rate of each track
    costs."""

    id: str
    description: bytes
    tracks: tuple[Track, ...]
    packets: list[list[list[bytes]]]
    performers: tuple[PerformerTracks, ...]
    bitrates_kbps: tuple[tuple[float, ...], ...]

    @property
    def first_track(self) -> MotionTrack:
        """The first performer's track, whose length is the motion's."""
        return self.performers[0].track

    @property
    def first_packets(self) -> list[list[bytes]]:
        """The Data messages of the first performer's track, by rate and index."""
        return self.packets[0]

    @property
    def total_bytes(self) -> int:
        """Bytes of all messages."""
        packets = (packet for track in self.packets for rate in track for packet in rate)
        return len(self.description) + sum(map(len, packets))


def pack(
    motion_id: str, encoded: EncodedMotion, scenes: Sequence[EncodedScene] = (), others: Sequence[EncodedMotion] = ()
) -> bytes:
    """The object of an encoded motion, with the `others` who dance with it, and the cameras and lights that belong to
    it.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    tracks: list[EncodedMotion | EncodedScene] = [encoded, *others, *scenes]
    if len(tracks) > MAX_TRACKS:
        raise ValueError(f"a motion has at most {MAX_TRACKS} tracks, not {len(tracks)}")
    packets = [
        _pack_data_messages(number, [rate.blocks for rate in track.ladder]) for number, track in enumerate(tracks)
    ]
    description = Description(motion_id, [track.describe() for track in tracks]).pack()
    packed: bytes = msgpack.packb({"description": description, "tracks": packets})
    return packed


def with_audio(motion_id: str, stored: StoredMotion, audio: EncodedAudio) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with its audio, which replaces what audio there was; and the types
    of its tracks. All other blocks are the same bytes.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    described = _track_descriptions(stored)
    packets = list(stored.packets)
    number = next((n for n, track in enumerate(described) if track["type"] == "audio"), len(described))
    if number == MAX_TRACKS:
        raise ValueError(f"a motion has at most {MAX_TRACKS} tracks, and this one has them without audio")
    described[number:] = [audio.describe(), *described[number + 1 :]]
    packets[number:] = [_pack_data_messages(number, [rate.blocks for rate in audio.ladder]), *packets[number + 1 :]]
    packed: bytes = msgpack.packb({"description": Description(motion_id, described).pack(), "tracks": packets})
    return packed, [track["type"] for track in described]


def with_scenes(
    motion_id: str, stored: StoredMotion, scenes: Sequence[EncodedScene], replaced_types: Container[str]
) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with cameras and lights, in place of its tracks of the `replaced`
    types; and the types of its tracks. All other blocks are the same but for the number of their track.

    Raises ValueError where there are more tracks than a Data message can number.
    """
    described = _track_descriptions(stored)
    kept = [number for number, track in enumerate(described) if track["type"] not in replaced_types]
    if len(kept) + len(scenes) > MAX_TRACKS:
        raise ValueError(f"a motion has at most {MAX_TRACKS} tracks, and this would have {len(kept) + len(scenes)}")
    blocks = [[[Data.unpack(packet).block for packet in rate] for rate in stored.packets[number]] for number in kept]
    blocks += [[rate.blocks for rate in scene.ladder] for scene in scenes]
    tracks = [*(described[number] for number in kept), *(scene.describe() for scene in scenes)]
    packets = [_pack_data_messages(number, rates) for number, rates in enumerate(blocks)]
    packed: bytes = msgpack.packb({"description": Description(motion_id, tracks).pack(), "tracks": packets})
    return packed, [track["type"] for track in tracks]


def with_performers(
    motion_id: str, stored: StoredMotion, others: Sequence[StoredMotion], placements: Sequence[Placement]
) -> tuple[bytes, list[str]]:
    """The object of the motion of this id: `stored` with the performers of `others` beside its own, each at its place
    of `places`, in this order; and the types of its tracks. All blocks are the same but for the number of their track.

    Raises ValueError where there are more performers or tracks than can be numbered.
    """
    own = _track_descriptions(stored)
    dancing = [(said, at) for said, at in zip(own, stored.packets, strict=True) if said["type"] == "motion"]
    beside = [(said, at) for said, at in zip(own, stored.packets, strict=True) if said["type"] != "motion"]
    for other in others:
        dancing += [
            (said, at)
            for said, at in zip(_track_descriptions(other), other.packets, strict=True)
            if said["type"] == "motion"
        ]
    if len(dancing) > MAX_PERFORMERS:
        raise ValueError(f"a stage has at most {MAX_PERFORMERS} performers, and this would have {len(dancing)}")
    if len(dancing) + len(beside) > MAX_TRACKS:
        raise ValueError(f"a motion has at most {MAX_TRACKS} tracks, not {len(dancing) + len(beside)}")
    placed = [(said | {"place": list(place)}, at) for (said, at), place in zip(dancing, placements, strict=True)]
    tracks = [said for said, _ in (*placed, *beside)]
    packets = [
        _pack_data_messages(number, [[Data.unpack(packet).block for packet in rate] for rate in at])
        for number, (_, at) in enumerate((*placed, *beside))
    ]
    packed: bytes = msgpack.packb({"description": Description(motion_id, tracks).pack(), "tracks": packets})
    return packed, [track["type"] for track in tracks]


def _track_descriptions(stored: StoredMotion) -> list[dict[str, Any]]:
    tracks: list[dict[str, Any]] = msgpack.unpackb(stored.description[1:])["tracks"]
    return tracks


def _pack_data_messages(track_number: int, levels: Sequence[Sequence[bytes]]) -> list[list[bytes]]:
    """The Data messages of a track's blocks, by rate and index."""
    return [
        [Data(track_number, nth, index, block).pack() for index, block in enumerate(blocks)]
        for nth, blocks in enumerate(levels)
    ]


def unpack(motion_id: str, packed: bytes) -> StoredMotion:
    """The motion in an object that `pack` made; raises `DamagedBlock` where it is in a codec that is not spoken."""
    values = msgpack.unpackb(packed)
    described: list[dict[str, Any]] = msgpack.unpackb(values["description"][1:])["tracks"]
    # objects from when a motion was one track have its packets alone
    packets = values["tracks"] if "tracks" in values else [values["packets"]]
    dances = tuple(
        PerformerTracks(
            parse_motion_track(said),
            at,
            float(said.get("front", 0.0)),
            Placement.parse(said.get("place", STAGE_CENTRE)),
        )
        for said, at in zip(described, packets, strict=True)
        if said["type"] == "motion"
    )
    first, beside = dances[0].track, described[len(dances) :]
    tracks: tuple[Track, ...] = (
        *(dance.track for dance in dances),
        *(
            parse_audio_track(track, first) if track["type"] == "audio" else parse_scene_track(track)
            for track in beside
        ),
    )
    kbps = tuple(tuple(float(rate["kbps"]) for rate in track["rates"]) for track in described)
    return StoredMotion(motion_id, values["description"], tracks, packets, dances, kbps)


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
        """Store the object that `pack` made."""
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
            stored = unpack(motion_id, packed)
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
