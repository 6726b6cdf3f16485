from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from bunraku.capture.calibration import calibrate
from bunraku.capture.frame import CapturedFrame
from bunraku.capture.retarget import Retargeter
from bunraku.capture.vmc import VmcAssembler
from bunraku.marionette.solver.vector import about_z, multiply
from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.readers.bvh import parse_bvh
from tests.capture.samples import joint_distances_mm, sample_frames
from tests.capture.vmc_performer import make_bundle, make_messages, perform

SKELETON = VmcAssembler.skeleton
CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
LIMITS_MM = dict.fromkeys(CLIPS, 3.0) | {"perfume_A": 15.0}
"""Mean distance from the analysis of the whole clip. perfume_A begins with three seconds in a pose with raised
shoulders, which one second of calibration takes for the shoulders' place."""


def capture(path: Path) -> tuple[list[CapturedFrame], float]:
    performance = perform(parse_bvh(path.read_bytes()))
    assembler = VmcAssembler()
    frames = [
        captured
        for frame in range(performance.frame_count)
        for captured in assembler.feed(make_bundle(make_messages(performance, frame, frame / performance.fps)))
    ]
    return frames, performance.fps


@pytest.mark.parametrize("clip", CLIPS)
def test_clip_as_vmc_stays_near_its_analysis(clip: str, shared: Path, tally: Callable[[str], None]) -> None:
    path = shared / "mocap" / "bvh" / f"{clip}.bvh"
    frames, fps = capture(path)
    retargeter = Retargeter(calibrate(SKELETON, frames[: round(fps)]))
    distances = joint_distances_mm(
        retargeter.figure, [retargeter.retarget(frame) for frame in frames], analyse(parse_bvh(path.read_bytes()))
    )
    tally(f"VMC, {clip}: mean {distances.mean():.2f} mm, max {distances.max():.1f} mm from the analysed clip")
    assert distances.mean() <= LIMITS_MM[clip]


def bend_spine(frames: list[CapturedFrame]) -> list[CapturedFrame]:
    """Return frames whose spine bends in a second joint, which the figure does not have."""
    return [
        CapturedFrame(
            frame.positions | {"Chest": (0.0, 0.2, 0.0)},
            frame.rotations | {"Chest": multiply(about_z(0.5 * sin(0.1 * number)), (cos(a), sin(a), 0.0, 0.0))},
        )
        for number, frame in enumerate(frames)
        for a in [0.2 * cos(0.17 * number)]
    ]


def test_single_frames_agree_with_the_fit_of_the_whole_clip() -> None:
    frames = bend_spine(sample_frames())
    calibration = calibrate(SKELETON, frames)
    fit = calibration.fit.fit
    assert any(rule.nearest is not None for rule in fit.rules.values())
    assert any(rule.aim is not None for rule in fit.rules.values())
    retargeter = Retargeter(calibration)
    poses = [retargeter.retarget(frame) for frame in frames]
    np.testing.assert_allclose([pose.root for pose in poses], fit.joint_positions[:, 0], atol=1e-9)
    agreement = np.abs(np.sum([pose.rotations for pose in poses] * fit.local_rotations(), axis=-1))
    np.testing.assert_allclose(agreement, 1.0, atol=1e-9)


def test_missing_joint_keeps_its_last_rotation() -> None:
    frames = sample_frames()
    retargeter = Retargeter(calibrate(SKELETON, frames))
    complete = retargeter.retarget(frames[20])
    later = CapturedFrame(
        {bone: place for bone, place in frames[40].positions.items() if bone != "LeftLowerArm"},
        {bone: turn for bone, turn in frames[40].rotations.items() if bone != "LeftLowerArm"},
    )
    pose = retargeter.retarget(later)
    elbow = 13
    assert abs(complete.rotations[elbow] @ pose.rotations[elbow]) == pytest.approx(1.0, abs=1e-6)
    full = retargeter.retarget(frames[40])
    others = [joint for joint in range(18) if joint not in (elbow, elbow + 1)]
    np.testing.assert_allclose(pose.rotations[others], full.rotations[others], atol=1e-9)
    assert abs(full.rotations[elbow] @ pose.rotations[elbow]) < 1.0 - 1e-4


def test_root_moves_and_turns_the_figure() -> None:
    frames = sample_frames()
    retargeter = Retargeter(calibrate(SKELETON, frames))
    there = retargeter.retarget(frames[20])
    turn = np.array([0.5**0.5, 0.0, 0.5**0.5, 0.0])
    moved = CapturedFrame(
        frames[20].positions | {"Root": (1.0, 0.0, 2.0)}, frames[20].rotations | {"Root": (turn[0], 0.0, turn[2], 0.0)}
    )
    pose = retargeter.retarget(moved)
    np.testing.assert_allclose(pose.root - [1.0, 0.0, 2.0], rotation.rotate(turn, there.root), atol=1e-6)
    np.testing.assert_allclose(pose.rotations[0], rotation.multiply(turn, there.rotations[0]), atol=1e-6)
    np.testing.assert_allclose(pose.rotations[1:], there.rotations[1:], atol=1e-6)


def test_blendshapes_pass_through() -> None:
    frames = sample_frames()
    retargeter = Retargeter(calibrate(SKELETON, frames))
    assert retargeter.retarget(CapturedFrame({}, {}, blendshapes={"Joy": 0.3})).blendshapes == {"Joy": 0.3}
