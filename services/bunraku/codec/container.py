"""Container format of stored motions: one object per motion, ready to be sent.

An object is a MessagePack map of the Description message (`description`) and the Data messages of every track, bitrate
level and block (`tracks`). Functions that change a motion return a new object; the stored one stays as it is.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import msgpack

from bunraku.codec.audio import AudioTrack, EncodedAudio, parse_audio_track
from bunraku.codec.extension.contact import ContactTrack, EncodedContacts, parse_contact_track
from bunraku.codec.extension.encoder import EncodedExtension
from bunraku.codec.extension.props import EncodedProps, PropTrack, parse_prop_track
from bunraku.codec.extension.track import EXTENSION_TYPE, ExtensionPart, ExtensionTrack, parse_extension_track
from bunraku.codec.motion_encoder import BitrateLevel, EncodedMotion
from bunraku.codec.motion_track import MotionTrack, parse_motion_track
from bunraku.codec.scene import SceneTrack, parse_scene_track
from bunraku.codec.scene_encoder import EncodedScene
from bunraku.motion.placement import STAGE_CENTRE, Placement
from bunraku.wire.limbs import MAX_PERFORMERS
from bunraku.wire.messages import Data, Description

MAX_TRACKS = 16
"""Limit of the tracks of a motion: a Data message has four bits for the track."""

Track = MotionTrack | SceneTrack | AudioTrack | ExtensionTrack | ContactTrack | PropTrack


@dataclass(frozen=True, slots=True)
class PerformerTracks:
    """The track of one performer.

    `packets[level][index]` are its Data messages, lowest level first. `front` is the direction that it faces, in
    radians about y from z towards x, and `placement` its place on the stage.
    """

    track: MotionTrack
    packets: list[list[bytes]]
    front: float
    placement: Placement


@dataclass(frozen=True, slots=True, weakref_slot=True)
class StoredMotion:
    """A motion as it is sent.

    `description` is its Description message. `tracks` has the tracks, those of the performers first, extensions last,
    `packets[track][level][index]` their Data messages, and `bitrates_kbps[track][level]` their bitrates, lowest level
    first.
    """

    id: str
    description: bytes
    tracks: tuple[Track, ...]
    packets: list[list[list[bytes]]]
    performers: tuple[PerformerTracks, ...]
    bitrates_kbps: tuple[tuple[float, ...], ...]

    @property
    def first_track(self) -> MotionTrack:
        """Track of the first performer, whose duration is that of the motion."""
        return self.performers[0].track

    @property
    def first_packets(self) -> list[list[bytes]]:
        """Data messages of the first performer's track, by level and index."""
        return self.packets[0]

    def blocks(self, track: int) -> list[list[bytes]]:
        """Return the blocks of a track, by level and index, without the headers of their messages."""
        return [[Data.unpack(packet).block for packet in level] for level in self.packets[track]]

    @property
    def total_bytes(self) -> int:
        """Size of all messages."""
        packets = (packet for track in self.packets for level in track for packet in level)
        return len(self.description) + sum(map(len, packets))


class _Level(Protocol):
    @property
    def blocks(self) -> list[bytes]: ...


class _EncodedTrack(Protocol):
    @property
    def ladder(self) -> Sequence[_Level]: ...

    def describe(self) -> dict[str, Any]: ...


class _ObjectTrack(NamedTuple):
    """A track on its way into an object: its entry in the Description, and its blocks by level and index."""

    description: dict[str, Any]
    blocks: list[list[bytes]]

    @property
    def type(self) -> str:
        """Type of the track: `motion`, `camera`, `light`, `audio` or `extension`."""
        track_type: str = self.description["type"]
        return track_type


def pack_motion(
    motion_id: str,
    encoded: EncodedMotion,
    scenes: Sequence[EncodedScene] = (),
    others: Sequence[EncodedMotion] = (),
    extensions: Sequence[EncodedExtension | EncodedContacts | EncodedProps] = (),
    audio: EncodedAudio | None = None,
) -> bytes:
    """Return the object of a motion: performers (`encoded`, then `others`), cameras and lights, audio, extensions.

    Raises ValueError for more than MAX_TRACKS tracks.
    """
    tracks: list[_EncodedTrack] = [encoded, *others, *scenes, *([audio] if audio is not None else []), *extensions]
    return _pack_object(motion_id, [_new_track(track.describe(), track.ladder) for track in tracks])[0]


def add_audio_track(motion_id: str, stored: StoredMotion, audio: EncodedAudio) -> tuple[bytes, list[str]]:
    """Return the object of a new motion: `stored` with its audio replaced by, or extended with, `audio`.

    Returns:
        The object, and the types of its tracks.

    Raises:
        ValueError: There would be more than MAX_TRACKS tracks.
    """
    tracks = _stored_tracks(stored)
    number = next((n for n, track in enumerate(tracks) if track.type == "audio"), len(tracks))
    tracks[number : number + 1] = [_new_track(audio.describe(), audio.ladder)]
    return _pack_object(motion_id, tracks)


def replace_scene_tracks(
    motion_id: str, stored: StoredMotion, scenes: Sequence[EncodedScene], replaced_types: Container[str]
) -> tuple[bytes, list[str]]:
    """Return the object of a new motion: `stored` with `scenes` instead of its tracks of some types.

    Returns:
        The object, and the types of its tracks.

    Raises:
        ValueError: There would be more than MAX_TRACKS tracks.
    """
    kept = [track for track in _stored_tracks(stored) if track.type not in replaced_types]
    return _pack_object(motion_id, [*kept, *(_new_track(scene.describe(), scene.ladder) for scene in scenes)])


def add_performers(
    motion_id: str, stored: StoredMotion, others: Sequence[StoredMotion], placements: Sequence[Placement]
) -> tuple[bytes, list[str]]:
    """Return the object of a new motion: `stored` with the performers of `others` after its own.

    Args:
        motion_id: Id of the new motion.
        stored: The motion whose scene and audio are kept.
        others: Motions of which only the performers are added.
        placements: Place on the stage of each performer, in this order.

    Returns:
        The object, and the types of its tracks.

    Raises:
        ValueError: There would be more than MAX_PERFORMERS performers or MAX_TRACKS tracks.
    """
    own = _stored_tracks(stored)
    performers = [track for track in own if track.type == "motion"]
    performers += [track for other in others for track in _stored_tracks(other) if track.type == "motion"]
    if len(performers) > MAX_PERFORMERS:
        raise ValueError(f"A motion has at most {MAX_PERFORMERS} performers, this would have {len(performers)}.")
    placed = [
        track._replace(description=track.description | {"place": list(placement)})
        for track, placement in zip(performers, placements, strict=True)
    ]
    staging = [track for track in own if track.type not in ("motion", EXTENSION_TYPE)]
    return _pack_object(motion_id, [*placed, *staging, *_joined_extensions([stored, *others])])


def stored_ladders(stored: StoredMotion) -> list[list[BitrateLevel]]:
    """Return the bitrate levels of each performer, with the figures that the Description gives."""
    return [
        [
            BitrateLevel(blocks, rate["kbps"], rate["mean"], rate["max"], rate["max"])
            for blocks, rate in zip(track.blocks, track.description["rates"], strict=True)
        ]
        for track in _stored_tracks(stored)[: len(stored.performers)]
    ]


def replace_ladders(stored: StoredMotion, ladders: Sequence[Sequence[BitrateLevel]]) -> bytes:
    """Return the object of `stored` with other bitrate levels of its performers."""
    tracks = _stored_tracks(stored)
    for number, ladder in enumerate(ladders):
        rates = [level.describe() for level in ladder]
        tracks[number] = _new_track(tracks[number].description | {"rates": rates}, ladder)
    return _pack_object(stored.id, tracks)[0]


def unpack_motion(motion_id: str, packed: bytes) -> StoredMotion:
    """Return the motion of an object. Raises `DamagedBlock` if it is of an unsupported codec."""
    values = msgpack.unpackb(packed)
    descriptions = _track_descriptions(values["description"])
    # objects of the first release have only the packets of one track
    packets = values["tracks"] if "tracks" in values else [values["packets"]]
    performers = tuple(
        PerformerTracks(
            parse_motion_track(description),
            track_packets,
            float(description.get("front", 0.0)),
            Placement.parse(description.get("place", STAGE_CENTRE)),
        )
        for description, track_packets in zip(descriptions, packets, strict=True)
        if description["type"] == "motion"
    )
    first_track = performers[0].track
    other_tracks = (_parse_other_track(description, first_track) for description in descriptions[len(performers) :])
    return StoredMotion(
        motion_id,
        values["description"],
        (*(performer.track for performer in performers), *other_tracks),
        packets,
        performers,
        tuple(tuple(float(rate["kbps"]) for rate in description["rates"]) for description in descriptions),
    )


def _parse_other_track(description: dict[str, Any], first_track: MotionTrack) -> Track:
    """Return a track that is no performer's motion. Raises `DamagedBlock`."""
    if description["type"] == "audio":
        return parse_audio_track(description, first_track)
    if description["type"] == EXTENSION_TYPE:
        if description.get("part") == ExtensionPart.CONTACTS:
            return parse_contact_track(description)
        if description.get("part") == ExtensionPart.PROPS:
            return parse_prop_track(description)
        return parse_extension_track(description)
    return parse_scene_track(description)


def _joined_extensions(motions: Sequence[StoredMotion]) -> list[_ObjectTrack]:
    """Return the extensions of all performers of `motions`, which are counted through."""
    found, performer_count = [], 0
    for motion in motions:
        for track in _stored_tracks(motion):
            if track.type == EXTENSION_TYPE:
                performer = performer_count + track.description["performer"]
                found.append(track._replace(description=track.description | {"performer": performer}))
        performer_count += len(motion.performers)
    return found


def _pack_object(motion_id: str, tracks: Sequence[_ObjectTrack]) -> tuple[bytes, list[str]]:
    """Return an object and the types of its tracks. Raises ValueError for more than MAX_TRACKS tracks.

    Extensions come last, part by part, as a stream without them describes only the tracks before; those without a
    number are left out.
    """
    required = [track for track in tracks if track.type != EXTENSION_TYPE]
    extensions = [track for part in ExtensionPart for track in tracks if track.description.get("part") == part.value]
    tracks = [*required, *extensions[: max(MAX_TRACKS - len(required), 0)]]
    if len(tracks) > MAX_TRACKS:
        raise ValueError(f"A motion has at most {MAX_TRACKS} tracks, this would have {len(tracks)}.")
    packets = [
        [
            [Data(number, level, index, block).pack() for index, block in enumerate(blocks)]
            for level, blocks in enumerate(track.blocks)
        ]
        for number, track in enumerate(tracks)
    ]
    description = Description(motion_id, [track.description for track in tracks]).pack()
    packed: bytes = msgpack.packb({"description": description, "tracks": packets})
    return packed, [track.type for track in tracks]


def _new_track(description: dict[str, Any], ladder: Iterable[_Level]) -> _ObjectTrack:
    return _ObjectTrack(description, [level.blocks for level in ladder])


def _stored_tracks(stored: StoredMotion) -> list[_ObjectTrack]:
    """Return the tracks of a stored motion, their blocks taken out of the Data messages."""
    return [
        _ObjectTrack(description, stored.blocks(number))
        for number, description in enumerate(_track_descriptions(stored.description))
    ]


def _track_descriptions(description: bytes) -> list[dict[str, Any]]:
    """Return the entries of `tracks` in a Description message."""
    tracks: list[dict[str, Any]] = msgpack.unpackb(description[1:])["tracks"]
    return tracks
