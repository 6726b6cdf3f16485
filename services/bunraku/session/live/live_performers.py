"""Live performers of a stage: their samples, and the messages that show them to viewers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bunraku.codec.container import StoredMotion
from bunraku.codec.live import LiveEncoder
from bunraku.codec.motion_track import MotionTrack
from bunraku.motion.rotation import Array
from bunraku.playout.block_store import Pose
from bunraku.playout.performance import Performance, SampleOutcome, sample_pose
from bunraku.session.live.cast import Cast, CastMember
from bunraku.wire.live import Live, LiveBlock, Sample


class LivePerformer:
    """One live performer, on the track of a motion that shows its figure at rest."""

    def __init__(self, member: CastMember, track: MotionTrack) -> None:
        self.member = member
        self.performance = Performance(track.figure, member.fps)
        self.outcomes: Counter[str] = Counter({outcome.value: 0 for outcome in SampleOutcome})
        """Samples by outcome."""
        self._encoder = LiveEncoder(track.skeleton)

    def encode(self, poses: Sequence[Pose], due: int, frame_time: int) -> LiveBlock:
        """Return the block of the poses of consecutive frames; the last is that of clock time `frame_time`."""
        age_us = due - frame_time + self.performance.delay_us(frame_time)
        return LiveBlock(age_us, self._encoder.encode(*_stack(poses)).data)

    def receive(self, sample: Sample, now: int) -> SampleOutcome:
        """Add a sample that arrived at `now`."""
        outcome = self.performance.add(sample.sampled, sample_pose(sample), now)
        self.outcomes[outcome.value] += 1
        return outcome


class LivePerformers:
    """Live performers of one stage, by the number of the performer."""

    def __init__(self) -> None:
        self._performers: dict[int, LivePerformer] = {}
        self._was_shown = False

    def __iter__(self) -> Iterator[LivePerformer]:
        return iter(self._performers.values())

    @property
    def is_shown(self) -> bool:
        """True if the last message showed a performer."""
        return self._was_shown

    def has_unshown_samples(self, now: int) -> bool:
        """Return whether a performer has a sample that is to be shown after `now`."""
        performances = [performer.performance for performer in self]
        return any(one.newest_us is not None and one.newest_us > now - one.delay_us(now) for one in performances)

    def assign(self, cast: Cast, motion: StoredMotion) -> None:
        """Show the members of a cast on the last performers of a motion; nobody if it is not the cast motion."""
        known = {performer.member.id: performer for performer in self}
        members = cast.members if cast.motion == motion.id else ()
        first = len(motion.performers) - len(members)
        self._performers = {
            number: known.get(member.id) or LivePerformer(member, motion.performers[number].track)
            for number, member in enumerate(members, first)
        }

    def find(self, performer_id: str) -> LivePerformer | None:
        """Return a performer by id, or None."""
        return next((one for one in self if one.member.id == performer_id), None)

    def number_of(self, performer_id: str) -> int | None:
        """Return the number of a performer on the stage, or None."""
        return next((number for number, one in self._performers.items() if one.member.id == performer_id), None)

    def presence(self) -> list[dict[str, Any]]:
        """Return the entries of Presence."""
        return [{"performer": n, "id": one.member.id, "name": one.member.name} for n, one in self._performers.items()]

    def poses_at(self, frame_time: int) -> dict[int, Pose]:
        """Return the poses to show for the frame of clock time `frame_time`; none for performers at rest."""
        poses: dict[int, Pose] = {}
        for number, performer in self._performers.items():
            performance = performer.performance
            capture = frame_time - performance.delay_us(frame_time)
            pose = performance.pose_at(capture)
            if not performance.is_at_rest(capture):
                poses[number] = pose
        return poses

    def pack(self, due: int, frame_time: int, frames: Sequence[dict[int, Pose]]) -> bytes | None:
        """Return the Live message of some frames, the last of clock time `frame_time` and due at `due`.

        None if nobody is, or was, shown.

        Performers who are not in all frames are shown from the next message on.
        """
        shown = set.intersection(*(set(frame) for frame in frames))
        if not shown and not self._was_shown:
            return None
        self._was_shown = bool(shown)
        blocks = {
            number: self._performers[number].encode([frame[number] for frame in frames], due, frame_time)
            for number in sorted(shown)
        }
        return Live(due, len(frames), blocks).pack()


def _stack(poses: Sequence[Pose]) -> tuple[Array, Array]:
    return np.stack([root for root, _ in poses]), np.stack([rotations for _, rotations in poses])
