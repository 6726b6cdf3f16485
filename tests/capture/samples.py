"""A synthetic dance as a performance, and the check of poses against the analysis of the same clip."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from bunraku.capture.calibration import calibrate
from bunraku.capture.frame import CapturedFrame, CaptureSkeleton
from bunraku.capture.retarget import Pose, Retargeter
from bunraku.capture.vmc import VmcAssembler
from bunraku.motion import rotation
from bunraku.motion.analysis import Analysis, analyse
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.skeleton import JOINT_INDEX, Figure, world_transforms
from tests.capture.vmc_performer import Performance, make_bundle, make_messages, perform
from tests.motion.synthetic_motion import export_bvh, pose_with_arms, smooth_motion

PELVIS = JOINT_INDEX["sacroiliac"]


@cache
def sample_clip(arms_degrees: float = 90.0) -> Bvh:
    """Return a dance of three seconds, with the arms of the rest pose raised by `arms_degrees` from hanging.

    Its root and pelvis move as one, as humanoids have one bone for both.
    """
    motion = smooth_motion(frames=90, swing=0.4)
    motion.rotations[:, PELVIS] = rotation.IDENTITY
    return parse_bvh(export_bvh(motion, pose_with_arms(arms_degrees)))


@cache
def sample_performance(arms_degrees: float = 90.0) -> Performance:
    return perform(sample_clip(arms_degrees))


@cache
def sample_analysis(arms_degrees: float = 90.0) -> Analysis:
    return analyse(sample_clip(arms_degrees))


def retarget_all(skeleton: CaptureSkeleton, frames: Sequence[CapturedFrame]) -> tuple[Figure, list[Pose]]:
    """Calibrate on all frames and return the poses."""
    retargeter = Retargeter(calibrate(skeleton, frames))
    return retargeter.figure, [retargeter.retarget(frame) for frame in frames]


def joint_distances_mm(figure: Figure, poses: Sequence[Pose], analysis: Analysis) -> np.ndarray:
    """Return the distances (n, 17) of the joints from the analysis of the same frames, millimetres.

    The pelvis is left out: only clips have a joint for it.
    """
    root = np.array([pose.root for pose in poses])
    rotations = np.array([pose.rotations for pose in poses])
    placed, _ = world_transforms(figure, root, rotations)
    motion = analysis.motion
    expected, _ = world_transforms(motion.figure, motion.root, motion.rotations)
    distances: np.ndarray = 1000.0 * np.linalg.norm(placed[-len(expected) :] - expected, axis=-1)
    return np.delete(distances, PELVIS, axis=1)


@cache
def sample_frames() -> list[CapturedFrame]:
    """Return the frames of the sample as VMC receives them."""
    performance = sample_performance()
    assembler = VmcAssembler()
    return [
        captured
        for frame in range(performance.frame_count)
        for captured in assembler.feed(make_bundle(make_messages(performance, frame, frame / performance.fps)))
    ]
