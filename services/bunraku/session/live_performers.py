"""Live performers of a stage: their samples, and the messages that show them to viewers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bunraku.codec.live import LiveEncoder
from bunraku.codec.motion_track import MotionTrack
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT
from bunraku.playout.block_store import Pose
from bunraku.playout.overlay_buffer import RADIANS_PER_UNIT
from bunraku.playout.performance import Performance, SampleOutcome
from bunraku.wire.live import Live, LiveBlock, Sample


class LivePerformer:
    """One live performer, on the track of a motion that shows its figure at rest."""

    def __init__(self, performer_id: str, track: MotionTrack, fps: float) -> None:
        """Expect about `fps` samples per second."""
        self.id = performer_id
        self.performance = Performance(track.figure, fps)
        self._encoder = LiveEncoder(track.skeleton)

    def encode(self, poses: Sequence[Pose], due: int, frame_time: int) -> LiveBlock:
        """Return the block of the poses of consecutive frames; the last is that of clock time `frame_time`."""
        age_us = due - frame_time + self.performance.delay_us(frame_time)
        return LiveBlock(age_us, self._encoder.encode(*_stack(poses)).data)

    def receive(self, sample: Sample, now: int) -> SampleOutcome:
        """Add a sample that arrived at `now`."""
        vectors = np.reshape(sample.rotations, (JOINT_COUNT, 3)) * RADIANS_PER_UNIT
        pose = np.array(sample.root), rotation.from_rotation_vector(vectors)
        return self.performance.add(sample.sampled, pose, now)


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

    def add(self, number: int, performer: LivePerformer) -> None:
        """Add a performer, or replace the one with this number."""
        self._performers[number] = performer

    def remove(self, performer_id: str) -> None:
        """Remove a performer."""
        self._performers = {n: one for n, one in self._performers.items() if one.id != performer_id}

    def find(self, performer_id: str) -> LivePerformer | None:
        """Return a performer by id, or None."""
        return next((one for one in self if one.id == performer_id), None)

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
