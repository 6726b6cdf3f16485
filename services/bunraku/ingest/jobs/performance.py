"""Job that encodes the samples of a live performance."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bunraku.codec.container import pack_motion
from bunraku.ingest.jobs.encoding import describe_encoding, encode_foot_contacts, encode_motions
from bunraku.ingest.result import NOTHING_TO_KEEP, JobRejection, JobResult
from bunraku.motion.skeleton import Figure, Motion
from bunraku.playout.block_store import Pose
from bunraku.playout.performance import MAX_GAP_US, Performance, sample_pose
from bunraku.storage.performance_store import PerformanceHeader
from bunraku.wire.live import Sample

MIN_SAMPLES = 2


def encode_performance(
    motion_id: str,
    header: PerformanceHeader,
    parts: Sequence[bytes],
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Encode a performance from its first to its last sample; `on_progress` receives the encoded share, 0..1."""
    samples = read_samples(parts)
    if len(samples) < MIN_SAMPLES:
        return JobRejection(NOTHING_TO_KEEP, f"the performance has {len(samples)} samples")
    motion = sample_evenly(header.figure, header.fps, samples)
    (encoded,) = encode_motions([motion], on_progress)
    contacts = encode_foot_contacts([motion], [encoded])
    return JobResult(
        pack_motion(motion_id, encoded, extensions=contacts),
        {
            **describe_encoding(motion, encoded),
            **({"tracks": ["motion", *(each.track.kind for each in contacts)]} if contacts else {}),
        },
    )


def read_samples(parts: Sequence[bytes]) -> list[Sample]:
    """Return the samples of all parts in the order of their capture, each time once; the end of a cut part is left."""
    size = Sample.LAYOUT.size
    by_time: dict[int, Sample] = {}
    for part in parts:
        for at in range(0, len(part) - size + 1, size):
            sample = Sample.unpack(part[at : at + size])
            by_time.setdefault(sample.sampled, sample)
    return [by_time[time] for time in sorted(by_time)]


def sample_evenly(figure: Figure, fps: float, samples: Sequence[Sample]) -> Motion:
    """Return the motion of samples in the order of their capture, at an even frame rate, as viewers saw it.

    Where the performer was silent, the figure stands still and then goes to rest, as on the stage.
    """
    performance = Performance(figure, fps, starts_at_rest=False)
    begin, end = samples[0].sampled, samples[-1].sampled
    frame_count = round((end - begin) * fps * 1e-6) + 1
    poses: list[Pose] = []
    following = 0
    for frame in range(frame_count):
        capture = min(begin + round(frame * 1e6 / fps), end)
        while following < len(samples) and samples[following].sampled <= capture + MAX_GAP_US:
            sample = samples[following]
            performance.add(sample.sampled, sample_pose(sample), sample.sampled)
            following += 1
        poses.append(performance.pose_at(capture))
    return Motion(figure, fps, np.stack([root for root, _ in poses]), np.stack([rotations for _, rotations in poses]))
