"""The tracks of a motion that a viewer wants, as they are paced and share its line."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.codec.audio import AudioTrack
from bunraku.codec.container import StoredMotion, Track
from bunraku.codec.motion_track import MotionTrack
from bunraku.codec.prior import SCENE_CHANNEL_COUNT
from bunraku.codec.scene import SceneTrack
from bunraku.delivery import allocation
from bunraku.delivery.block_scheduler import ScheduledTrack
from bunraku.motion.skeleton import CHANNEL_COUNT
from bunraku.wire.messages import Description, unpack

TRACK_TYPES = ("motion", "audio", "camera", "light")
"""Types of tracks that a viewer may ask for."""


def count_channels(motion: StoredMotion) -> int:
    """How many channels all the tracks of a motion have."""
    return sum(map(_count_track_channels, motion.tracks))


def count_described_tracks(motion: StoredMotion, track_types: Sequence[str]) -> int:
    """How many tracks one is told of who wants these types: none after the last wanted one, as that leaves the others'
    numbers as they are."""
    return 1 + max(
        (number for number, track in enumerate(motion.tracks) if _track_type(track) in track_types), default=0
    )


def pack_description(motion: StoredMotion, first: int, end: int) -> bytes:
    """A motion's Description of the tracks from index `first` to before `end`: on a narrow line what is told of the
    others costs more than the first block."""
    if first == 0 and end == len(motion.tracks):
        return motion.description
    whole = unpack(motion.description)
    assert isinstance(whole, Description)
    return Description(whole.motion, whole.tracks[first:end], first or None).pack()


def select_tracks(motion: StoredMotion, track_types: Sequence[str]) -> list[ScheduledTrack]:
    """The tracks of a motion whose blocks a viewer wants."""
    return [
        ScheduledTrack(
            number, track, len(motion.packets[number]), _track_type(track) == "motion", _track_type(track) == "audio"
        )
        for number, track in enumerate(motion.tracks)
        if _track_type(track) in track_types
    ]


def build_allocations(motion: StoredMotion, track_types: Sequence[str]) -> tuple[allocation.BitrateAllocation, ...]:
    """The ways in which the tracks that a viewer wants may share its line."""
    kinds = list(map(_track_type, motion.tracks))
    audio = motion.bitrates_kbps[kinds.index("audio")] if "audio" in kinds and "audio" in track_types else ()
    return allocation.build_allocations(motion_bitrates(motion) if "motion" in track_types or not audio else (), audio)


def motion_bitrates(motion: StoredMotion) -> list[float]:
    """What each rate of the dances of all performers costs, kbit/s: as many as one has at most, of one with fewer its
    highest."""
    each = motion.bitrates_kbps[: len(motion.performers)]
    return [sum(kbps[min(rate, len(kbps) - 1)] for kbps in each) for rate in range(max(map(len, each)))]


def _count_track_channels(track: Track) -> int:
    if isinstance(track, AudioTrack):
        return track.channels
    return SCENE_CHANNEL_COUNT if isinstance(track, SceneTrack) else CHANNEL_COUNT


def _track_type(track: Track) -> str:
    return "motion" if isinstance(track, MotionTrack) else track.kind
