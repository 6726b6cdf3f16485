from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec.container import unpack_motion
from bunraku.codec.extension.contact import ContactTrack
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.ingest.jobs.performance import encode_performance, read_samples, sample_evenly
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, joint_and_tip_positions, standard_figure
from bunraku.playout.block_store import Pose
from bunraku.playout.performance import FADE_US, HOLD_US, pack_sample
from bunraku.storage.performance_store import PerformanceHeader
from bunraku.wire.live import Sample
from bunraku.wire.messages import Data

BEGIN_US = 1_700_000_000_000_000
HEADER = PerformanceHeader("session-1", "Aiko", 60.0, standard_figure(), BEGIN_US)


def pose_at(time_us: int) -> Pose:
    t = (time_us - BEGIN_US) * 1e-6
    vectors = 0.3 * np.sin(t + np.arange(JOINT_COUNT * 3)).reshape(JOINT_COUNT, 3)
    return np.array([0.1 * t, 0.9, 0.0]), rotation.from_rotation_vector(vectors)


def samples_between(begin_us: int, end_us: int, fps: float) -> list[Sample]:
    times = np.arange(begin_us, end_us + 1, 1e6 / fps).round().astype(int).tolist()
    return [pack_sample(time, pose_at(time)) for time in times]


def points(root: Array, rotations: Array) -> Array:
    positions: Array = joint_and_tip_positions(HEADER.figure, root, rotations)
    return positions


def test_parts_in_any_order_give_each_sample_once() -> None:
    samples = samples_between(BEGIN_US, BEGIN_US + 1_000_000, 60.0)
    packed = [sample.pack() for sample in samples]
    parts = [b"".join(packed[30:]), b"".join(packed[:40])[:-1], b"".join(packed[35:41]), b""]
    assert read_samples(parts) == samples


@pytest.mark.parametrize("fps", [24.0, 60.0, 97.0, 240.0])
def test_motion_has_the_poses_of_the_samples_to_the_last_frame(fps: float) -> None:
    samples = samples_between(BEGIN_US, BEGIN_US + 2_000_000, fps)
    motion = sample_evenly(HEADER.figure, fps, samples)
    assert motion.frame_count == len(samples)
    expected = [pose_at(sample.sampled) for sample in samples]
    truth = np.stack([points(*pose) for pose in expected])
    assert np.linalg.norm(points(motion.root, motion.rotations) - truth, axis=-1).max() < 5e-4


def test_lost_samples_are_interpolated_and_a_long_silence_rests() -> None:
    kept = [one for k, one in enumerate(samples_between(BEGIN_US, BEGIN_US + 1_000_000, 60.0)) if k % 7 not in (2, 3)]
    motion = sample_evenly(HEADER.figure, 60.0, kept)
    truth = np.stack([points(*pose_at(BEGIN_US + round(k * 1e6 / 60))) for k in range(motion.frame_count)])
    assert np.linalg.norm(points(motion.root, motion.rotations) - truth, axis=-1).max() < 5e-3
    silence_us = 3_000_000
    again = samples_between(BEGIN_US + 1_000_000 + silence_us, BEGIN_US + 5_000_000, 60.0)
    motion = sample_evenly(HEADER.figure, 60.0, [*kept, *again])
    rested = 60 + round((HOLD_US + FADE_US) * 60e-6) + 3
    assert np.abs(motion.rotations[rested, :, 0]).min() > 0.99999
    steps = np.linalg.norm(np.diff(points(motion.root, motion.rotations), axis=0), axis=-1)
    assert steps.max() < 0.12


def test_encoded_motion_is_within_its_bound() -> None:
    samples = samples_between(BEGIN_US, BEGIN_US + 2_000_000, 60.0)
    progress: list[float] = []
    result = encode_performance("motion", HEADER, [b"".join(one.pack() for one in samples)], progress.append)
    assert isinstance(result, JobResult)
    assert result.description["frames"] == 121
    assert max(progress) == 1.0
    (performer,) = unpack_motion("motion", result.packed).performers
    first = 0
    for index, packet in enumerate(performer.packets[-1]):
        frames = performer.track.frames_in(index)
        poses = decode_motion_block(performer.track, Data.unpack(packet).block).pose_at(np.arange(float(frames)))
        truth = np.stack([points(*pose_at(samples[first + k].sampled)) for k in range(frames)])
        assert np.linalg.norm(points(*poses) - truth, axis=-1).mean() < 1e-3
        first += frames


@pytest.mark.parametrize("count", [0, 1])
def test_performance_without_movement_in_time_is_rejected(count: int) -> None:
    parts = [pack_sample(BEGIN_US, pose_at(BEGIN_US)).pack()] * count
    rejection = encode_performance("motion", HEADER, parts)
    assert isinstance(rejection, JobRejection)
    assert rejection.title == "Nothing to keep"


def test_performer_who_stands_has_contacts() -> None:
    standing = np.array([0.0, 0.824, 0.0]), pose_at(BEGIN_US)[1] * 0 + [1.0, 0.0, 0.0, 0.0]
    samples = [pack_sample(BEGIN_US + round(k * 1e6 / 60), standing).pack() for k in range(60)]
    result = encode_performance("motion", HEADER, [b"".join(samples)])
    assert isinstance(result, JobResult)
    assert result.description["tracks"] == ["motion", "extension"]
    assert isinstance(unpack_motion("motion", result.packed).tracks[1], ContactTrack)
