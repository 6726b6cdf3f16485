"""Tracks of a motion that a viewer selects, as the scheduler and the bitrate selector see them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bunraku.codec.audio import AudioTrack
from bunraku.codec.container import StoredMotion, Track
from bunraku.codec.extension.contact import ContactTrack
from bunraku.codec.extension.props import PropTrack
from bunraku.codec.extension.track import ExtensionTrack
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.scene import SCENE_CHANNEL_COUNT, SceneTrack
from bunraku.delivery import allocation
from bunraku.delivery.block_scheduler import ScheduledTrack
from bunraku.delivery.resume import ResumeState
from bunraku.motion.contact.foot_contact import FEET
from bunraku.motion.skeleton import CHANNEL_COUNT
from bunraku.wire.messages import Description, unpack

TRACK_TYPES = ("motion", "audio", "camera", "light")
"""Types of tracks that a viewer may request by name, and is sent by default; extensions have their own parameters."""


@dataclass(frozen=True, slots=True)
class ViewerOptions:
    """Options that a viewer sends in the URL of its stream."""

    pinned_level: int | None = None
    """Bitrate level of the motion to keep to; None to adapt it."""
    track_types: tuple[str, ...] = TRACK_TYPES
    """Types of the tracks, and parts of the extensions, whose blocks are sent."""
    has_own_timeline: bool = False
    """True for a viewer of a stored motion, who may edit the timeline."""
    resume_state: ResumeState | None = None
    """Blocks that the viewer still holds from an earlier connection; they are not sent again."""


def count_channels(motion: StoredMotion) -> int:
    """Return the number of channels of all tracks of a motion."""
    return sum(map(_count_track_channels, motion.tracks))


def count_described_tracks(motion: StoredMotion, track_types: Sequence[str]) -> int:
    """Return how many tracks the Description for a viewer holds.

    Tracks after the last selected one are left out; those before it stay, since a track is addressed by its index.
    """
    return 1 + max((index for index, track in enumerate(motion.tracks) if _track_type(track) in track_types), default=0)


def pack_description(motion: StoredMotion, first: int, end: int) -> bytes:
    """Pack a Description of the tracks from index `first` to before `end`.

    On a constrained link the description of all tracks would cost more than the first block.
    """
    if first == 0 and end == len(motion.tracks):
        return motion.description
    complete = unpack(motion.description)
    assert isinstance(complete, Description)
    return Description(complete.motion, complete.tracks[first:end], first or None).pack()


def select_tracks(motion: StoredMotion, track_types: Sequence[str]) -> list[ScheduledTrack]:
    """Return the tracks of these types, for the scheduler."""
    return [
        ScheduledTrack(
            index, track, len(motion.packets[index]), _track_type(track) == "motion", _track_type(track) == "audio"
        )
        for index, track in enumerate(motion.tracks)
        if _track_type(track) in track_types
    ]


def build_allocations(motion: StoredMotion, track_types: Sequence[str]) -> tuple[allocation.BitrateAllocation, ...]:
    """Return the allocations of bandwidth to the motion and audio tracks of these types."""
    types = list(map(_track_type, motion.tracks))
    audio = motion.bitrates_kbps[types.index("audio")] if "audio" in types and "audio" in track_types else ()
    return allocation.build_allocations(motion_bitrates(motion) if "motion" in track_types or not audio else (), audio)


def motion_bitrates(motion: StoredMotion) -> list[float]:
    """Return the bitrate of all performers together at each level, kbit/s.

    A performer with fewer levels than another counts with its highest.
    """
    each = motion.bitrates_kbps[: len(motion.performers)]
    return [sum(kbps[min(level, len(kbps) - 1)] for kbps in each) for level in range(max(map(len, each)))]


def _count_track_channels(track: Track) -> int:
    if isinstance(track, AudioTrack):
        return track.channels
    if isinstance(track, ExtensionTrack):
        return len(track.layout.axes)
    if isinstance(track, ContactTrack):
        return len(FEET)
    if isinstance(track, PropTrack):
        return len(track.kinds)
    return SCENE_CHANNEL_COUNT if isinstance(track, SceneTrack) else CHANNEL_COUNT


def _track_type(track: Track) -> str:
    """Return the type of a track, of an extension its part."""
    if isinstance(track, ExtensionTrack | ContactTrack | PropTrack):
        return track.part.value
    return "motion" if isinstance(track, MotionTrack) else track.kind
