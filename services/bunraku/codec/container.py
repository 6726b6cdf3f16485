"""Container format of stored motions: one object holds a whole motion.

An object is a MessagePack map of the Description and of every Data message of every track and bitrate level, ready to
be sent. Functions that change a motion return a new object; the stored one stays as it is.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass
from typing import Any

import msgpack

from bunraku.codec.audio import AudioTrack, EncodedAudio, parse_audio_track
from bunraku.codec.motion_encoder import EncodedMotion
from bunraku.codec.motion_track import MotionTrack, parse_motion_track
from bunraku.codec.scene import SceneTrack, parse_scene_track
from bunraku.codec.scene_encoder import EncodedScene
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.wire.limbs import MAX_PERFORMERS
from bunraku.wire.messages import Data, Description

MAX_TRACKS = 16
"""Tracks that a Data message can number."""

Track = MotionTrack | SceneTrack | AudioTrack


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


def pack_motion(
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


def add_audio_track(motion_id: str, stored: StoredMotion, audio: EncodedAudio) -> tuple[bytes, list[str]]:
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


def replace_scene_tracks(
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


def add_performers(
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


def unpack_motion(motion_id: str, packed: bytes) -> StoredMotion:
    """The motion in an object that `pack_motion` made; raises `DamagedBlock` where it is in a codec that is not spoken."""
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
