"""The tracks of a motion that a viewer wants, as they are paced and share its line."""

from __future__ import annotations

from collections.abc import Sequence

from bunraku.backing.library import StoredMotion, Track
from bunraku.codec.audio import AudioTrack
from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.scene import SceneTrack
from bunraku.codec.track import MotionTrack
from bunraku.motion.skeleton import CHANNEL_COUNT
from bunraku.playout import sharing
from bunraku.playout.pacing import Paced
from bunraku.wire.messages import Description, unpack

TRACKS = ("motion", "audio", "camera", "light")
"""Types of tracks that a viewer may ask for."""


def channels(motion: StoredMotion) -> int:
    """How many channels all the tracks of a motion have."""
    return sum(map(_channels, motion.tracks))


def told_of(motion: StoredMotion, wanted: Sequence[str]) -> int:
    """How many tracks one is told of who wants these types: none after the last wanted one, as that leaves the others'
    numbers as they are."""
    return 1 + max((number for number, track in enumerate(motion.tracks) if _kind(track) in wanted), default=0)


def described(motion: StoredMotion, first: int, end: int) -> bytes:
    """A motion's Description of the tracks from index `first` to before `end`: on a narrow line what is told of the
    others costs more than the first block."""
    if first == 0 and end == len(motion.tracks):
        return motion.description
    whole = unpack(motion.description)
    assert isinstance(whole, Description)
    return Description(whole.motion, whole.tracks[first:end], first or None).pack()


def paced(motion: StoredMotion, wanted: Sequence[str]) -> list[Paced]:
    """The tracks of a motion whose blocks a viewer wants."""
    return [
        Paced(number, track, len(motion.packets[number]), _kind(track) == "motion", _kind(track) == "audio")
        for number, track in enumerate(motion.tracks)
        if _kind(track) in wanted
    ]


def steps(motion: StoredMotion, wanted: Sequence[str]) -> tuple[sharing.Step, ...]:
    """The ways in which the tracks that a viewer wants may share its line."""
    kinds = list(map(_kind, motion.tracks))
    audio = motion.kbps[kinds.index("audio")] if "audio" in kinds and "audio" in wanted else ()
    return sharing.steps(danced(motion) if "motion" in wanted or not audio else (), audio)


def danced(motion: StoredMotion) -> list[float]:
    """What each rate of the dances of all performers costs, kbit/s: as many as one has at most, of one with fewer its
    highest."""
    each = motion.kbps[: len(motion.dances)]
    return [sum(kbps[min(rate, len(kbps) - 1)] for kbps in each) for rate in range(max(map(len, each)))]


def _channels(track: Track) -> int:
    if isinstance(track, AudioTrack):
        return track.channels
    return SCENE_CHANNELS if isinstance(track, SceneTrack) else CHANNEL_COUNT


def _kind(track: Track) -> str:
    return "motion" if isinstance(track, MotionTrack) else track.kind
